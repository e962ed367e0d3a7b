// No damage to a checkpoint goes unnoticed, and none brings the reader down.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <random>

#include "checkpoint/posix_file.h"
#include "checkpoint/seal.h"
#include "unit/checkpoint_test_case.h"

namespace bedflow {
namespace {

using test::content_of;
using test::SharedFolder;
namespace fs = std::filesystem;

constexpr std::size_t several_blocks = 400000;  // values: 3.05 MiB, so 4 blocks

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write_file(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}
void change_file(const fs::path& path, std::uint64_t place, const std::string& bytes) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(place));
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}
// Where the given bytes of an array lie in a file.
std::uint64_t find_values(const std::string& file, double first) {
  return file.find(std::string(reinterpret_cast<const char*>(&first), sizeof(first)));
}

// A good checkpoint of one rank, and room for a damaged copy.
class CheckpointDamage : public testing::Test {
 protected:
  CheckpointDamage() : folder_(Comm::self()) {
    path_ = write_checkpoint(Comm::self(), folder_.checkpoints(), content_of(Comm::self(), 42, several_blocks), 2).path;
    bytes_ = read_file(path_);
    copy_ = folder_.job() / "copy.h5";
    write_file(copy_, bytes_);
  }
  SharedFolder folder_;
  fs::path path_, copy_;
  std::string bytes_;
};

TEST_F(CheckpointDamage, AnUntouchedFileIsGood) {
  EXPECT_EQ(verify_checkpoint(copy_), std::vector<std::string>{});
}

TEST_F(CheckpointDamage, EveryFlippedBitIsFound) {
  // The first 12 KiB hold seal, manifest and metadata; the arrays come after, and some metadata at the end.
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 400; ++trial) {
    const std::size_t within = trial % 2 == 0 ? 12288 : bytes_.size();
    const std::size_t place = trial < 40 ? bytes_.size() - 1 - static_cast<std::size_t>(trial) * 16 : random() % within;
    const auto flipped = static_cast<char>(bytes_[place] ^ (1 << random() % 8));
    change_file(copy_, place, std::string(1, flipped));
    ASSERT_NE(verify_checkpoint(copy_), std::vector<std::string>{}) << "byte " << place;
    if (trial % 20 == 0) {
      ASSERT_THROW(CheckpointReader(Comm::self(), copy_), Stop) << "byte " << place;
    }
    change_file(copy_, place, bytes_.substr(place, 1));
  }
  EXPECT_EQ(verify_checkpoint(copy_), std::vector<std::string>{});
}

TEST_F(CheckpointDamage, EveryCutIsFound) {
  for (std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{511}, std::size_t{512}, std::size_t{513},
                             std::size_t{4096}, bytes_.size() / 2, bytes_.size() - 4096, bytes_.size() - 1}) {
    write_file(copy_, bytes_.substr(0, length));
    EXPECT_NE(verify_checkpoint(copy_), std::vector<std::string>{}) << "cut to " << length << " bytes";
    EXPECT_THROW(CheckpointReader(Comm::self(), copy_), Stop) << "cut to " << length << " bytes";
  }
  write_file(copy_, bytes_ + "x");
  EXPECT_EQ(verify_checkpoint(copy_).at(0).substr(0, 8), "too long");
}

TEST_F(CheckpointDamage, AZeroedBlockIsNamedWithItsDataset) {
  const std::uint64_t start = find_values(bytes_, std::sin(1.0));
  change_file(copy_, start + (2 << 20), std::string(1 << 20, '\0'));
  const std::vector<std::string> faults = verify_checkpoint(copy_);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].substr(0, 34), "statistics/bins block 2: checksum ");
  EXPECT_NE(faults[0].find("all zeros"), std::string::npos);
}

TEST_F(CheckpointDamage, AFlippedValueIsNamedWithItsDatasetAndBlock) {
  const std::uint64_t place = find_values(bytes_, test::cell_value(3, 4, 2));
  change_file(copy_, place, std::string(1, static_cast<char>(bytes_[place] ^ 1)));
  EXPECT_EQ(verify_checkpoint(copy_).at(0).substr(0, 31), "gas/pressure block 0: checksum ");
  try {
    const CheckpointReader reader(Comm::self(), copy_);
    ADD_FAILURE() << "a damaged file was opened";
  } catch (const Stop& stop) {
    EXPECT_EQ(stop.reason, Reason::checkpoint_corrupt);
    EXPECT_NE(std::string(stop.what()).find("gas/pressure block 0"), std::string::npos) << stop.what();
  }
}

TEST_F(CheckpointDamage, ForeignAndHostileBytesAreRefused) {
  std::mt19937_64 random(2);
  std::string noise(5000, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  for (const std::string& bytes : {std::string(), std::string("not a checkpoint"), std::string(100000, '\0'), noise,
                                   "\x89HDF\r\n\x1a\n" + noise, bytes_.substr(0, 512) + noise, bytes_.substr(0, 20) + noise}) {
    write_file(copy_, bytes);
    EXPECT_EQ(verify_checkpoint(copy_).empty(), false);
    EXPECT_THROW(CheckpointReader(Comm::self(), copy_), Stop);
  }
  EXPECT_NE(verify_checkpoint(folder_.job() / "nothing.h5").at(0).find("No such file"), std::string::npos);
  EXPECT_FALSE(verify_checkpoint(folder_.job()).empty());  // a folder
}

TEST_F(CheckpointDamage, ASealThatLiesIsFound) {
  std::string fault;
  const Seal good = Seal::read(PosixFile(copy_, PosixFile::Mode::read), fault).value();
  constexpr std::uint64_t far = UINT64_MAX;
  for (const auto& [member, value] : std::vector<std::pair<std::uint64_t Seal::*, std::uint64_t>>{{&Seal::file_bytes, far},
                                                                                                  {&Seal::file_bytes, 600},
                                                                                                  {&Seal::file_bytes, 0},
                                                                                                  {&Seal::manifest_place, far},
                                                                                                  {&Seal::manifest_place, 0},
                                                                                                  {&Seal::manifest_bytes, far},
                                                                                                  {&Seal::manifest_bytes, 0}}) {
    Seal lie = good;
    lie.*member = value;
    lie.write(PosixFile(copy_, PosixFile::Mode::write));
    EXPECT_FALSE(verify_checkpoint(copy_).empty()) << value;
    EXPECT_THROW(CheckpointReader(Comm::self(), copy_), Stop) << value;
  }
}

TEST(Manifest, MutilatedTextIsRefusedOrHarmless) {
  const Manifest good{{{"a", 512, 3 << 20, {1, 2, 3}}, {"b/c", 1 << 22, 0, {}}, {"d", 1 << 23, 5, {4}}}};
  const std::string text = good.text();
  EXPECT_EQ(Manifest::parse(text, 1 << 24).value().text(), text);
  EXPECT_FALSE(Manifest::parse(text, 1 << 20).has_value()) << "entries beyond the file's end";
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 20000; ++trial) {
    std::string changed = text;
    for (int flips = 0; flips < 3; ++flips) changed[random() % changed.size()] = "0f \nZ\xff"[random() % 6];
    if (trial % 3 == 0) changed.resize(random() % changed.size());
    const std::optional<Manifest> read = Manifest::parse(changed, 1 << 24);
    for (const ManifestEntry& entry : read.value_or(Manifest{}).entries)
      ASSERT_LE(entry.place + entry.bytes, 1U << 24) << changed;
  }
}

TEST(NewestGoodCheckpoint, IsThePreviousOneWhenTheNewestIsDamaged) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  for (std::uint64_t step = 1; step <= 2; ++step) write_checkpoint(comm, folder.checkpoints(), content_of(comm, step, 1000), 2);
  const fs::path newest = folder.checkpoints() / "checkpoint_0000000002.h5";
  if (comm.root()) change_file(newest, find_values(read_file(newest), std::sin(1.0)), "x");
  comm.barrier();
  std::vector<std::string> faults;
  const CheckpointInfo found = newest_good_checkpoint(comm, folder.checkpoints(), faults).value();
  EXPECT_EQ(found.step, 1U);
  EXPECT_EQ(found.time, 0.1);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].substr(0, 49), "checkpoint_0000000002.h5: statistics/bins block 0");
}

TEST(NewestGoodCheckpoint, IsNoneInAnEmptyOrMissingFolder) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  std::vector<std::string> faults;
  EXPECT_FALSE(newest_good_checkpoint(comm, folder.job(), faults).has_value());
  EXPECT_FALSE(newest_good_checkpoint(comm, folder.job() / "missing", faults).has_value());
  EXPECT_TRUE(faults.empty());
}

void expect_disk_full(const Comm& comm, const fs::path& folder) {
  for (const bool one_writer : {false, true}) {
    try {
      write_checkpoint(comm, folder, content_of(comm, 2, several_blocks), 2, 0, one_writer);
      ADD_FAILURE() << "a checkpoint was written where there is no room";
    } catch (const Stop& stop) {
      EXPECT_EQ(stop.reason, Reason::disk_full) << stop.what();
    }
  }
  comm.barrier();
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1) << "the partial file is still there";
  EXPECT_EQ(verify_checkpoint(folder / "checkpoint_0000000001.h5"), std::vector<std::string>{});
}

// A file system of 1 MiB at a folder, where that can be mounted.
struct SmallDisk {
  SmallDisk(const Comm& comm, const fs::path& folder) : path(folder) {
    if (!comm.root()) return;
    fs::create_directories(folder);
    mounted = ::mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=1m") == 0;
  }
  ~SmallDisk() {
    if (mounted) ::umount(path.c_str());
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  fs::path path;
  bool mounted = false;
};

TEST(FullDisk, StopsEveryRankAndKeepsTheOlderCheckpoint) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  const SmallDisk disk(comm, folder.checkpoints());
  if (!comm.any(disk.mounted)) GTEST_SKIP() << "a small file system cannot be mounted here (that takes root)";
  write_checkpoint(comm, folder.checkpoints(), content_of(comm, 1), 2);
  expect_disk_full(comm, folder.checkpoints());
  comm.barrier();
  if (comm.root()) {  // and where the free space shrinks between the look at it and the reservation
    const fs::path path = folder.checkpoints() / "reserved";
    write_file(path, "");
    try {
      PosixFile(path, PosixFile::Mode::write).reserve(2 << 20);
      ADD_FAILURE() << "2 MiB were reserved on a file system of 1 MiB";
    } catch (const Stop& stop) {
      EXPECT_EQ(stop.reason, Reason::disk_full) << stop.what();
    }
  }
  comm.barrier();
}

TEST(FullDisk, ALimitOnFileSizesIsTheSame) {
  const Comm comm = Comm::world();
  const SharedFolder folder(comm);
  write_checkpoint(comm, folder.checkpoints(), content_of(comm, 1), 2);
  struct rlimit old {};
  ::getrlimit(RLIMIT_FSIZE, &old);
  const struct rlimit tight = {1 << 20, old.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &tight);
  expect_disk_full(comm, folder.checkpoints());
  ::setrlimit(RLIMIT_FSIZE, &old);
}

}  // namespace
}  // namespace bedflow
