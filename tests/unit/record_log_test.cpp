// The framed log: what was appended is read, torn ends are tolerated, damage before the end is not.
#include "record_log.h"

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <csignal>
#include <fstream>
#include <random>
#include <system_error>
#include <thread>

namespace bedflow {
namespace {

class RecordLog : public testing::Test {
 protected:
  RecordLog() : path_(std::filesystem::temp_directory_path() / ("bedflow_record_log_" + std::to_string(::getpid()))) {
    std::filesystem::remove(path_);
  }
  ~RecordLog() override { std::filesystem::remove(path_); }

  std::string bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void set_bytes(const std::string& bytes) const {
    std::filesystem::remove(path_);  // a file cut to nothing and written again is flushed to disk, which is slow
    std::ofstream(path_, std::ios::binary) << bytes;
  }

  // Payloads in order; `whole` tells whether the log was found sound.
  std::vector<std::string> payloads(bool* whole = nullptr) const {
    std::vector<std::string> found;
    LogReader reader(path_);
    const bool sound = reader.read([&](const LogRecord& record) {
      EXPECT_EQ(record.sequence, found.size() + 1);
      found.push_back(record.payload);
    });
    if (whole != nullptr) *whole = sound;
    return found;
  }

  std::filesystem::path path_;
};

TEST(Crc32c, GivesTheStandardCheckValue) {
  EXPECT_EQ(crc32c("123456789"), 0xE3069283U);
}

TEST(Crc32c, OfPartsIsThatOfTheWhole) {
  EXPECT_EQ(crc32c("6789", crc32c("12345")), crc32c("123456789"));
  EXPECT_EQ(crc32c(""), 0U);
}

// Short spans and long ones are summed in different ways.
TEST(Crc32c, OfEveryLengthIsThatOfItsDefinition) {
  std::string bytes;
  std::uint32_t remainder = ~0U;  // bit by bit: x³²+x²⁸+…, reflected
  for (int length = 0; length <= 400; ++length) {
    ASSERT_EQ(crc32c(bytes), ~remainder) << length;
    bytes += static_cast<char>(length * 37 + length / 11);
    remainder ^= static_cast<unsigned char>(bytes.back());
    for (int bit = 0; bit < 8; ++bit) remainder = remainder >> 1 ^ (remainder & 1U ? 0x82F63B78U : 0U);
  }
}

TEST_F(RecordLog, GivesBackWhatWasAppendedInOrder) {
  const std::vector<std::string> written{"one", "", std::string(3'000'000, 'x'), std::string("\0\1\2", 3)};  // one above a chunk
  LogWriter writer(path_);
  for (std::size_t i = 0; i < written.size(); ++i) EXPECT_EQ(writer.append(static_cast<std::uint32_t>(i), written[i]), i + 1);
  writer.sync();
  EXPECT_EQ(payloads(), written);
}

TEST_F(RecordLog, ThatDoesNotExistYetIsEmpty) {
  bool whole = false;
  EXPECT_TRUE(payloads(&whole).empty());
  EXPECT_TRUE(whole);
}

TEST_F(RecordLog, ReaderTakesUpWhereItStopped) {
  LogWriter writer(path_);
  LogReader reader(path_);
  std::vector<std::string> found;
  const auto take = [&](const LogRecord& record) { found.push_back(record.payload); };
  for (const std::string text : {"a", "b", "c"}) {
    writer.append(0, text);
    EXPECT_TRUE(reader.read(take));
    EXPECT_EQ(found.back(), text);
  }
  EXPECT_EQ(found.size(), 3U);
  EXPECT_EQ(reader.offset(), std::filesystem::file_size(path_));
}

TEST_F(RecordLog, CutAnywhereGivesTheWholeRecordsBeforeTheCut) {
  {
    LogWriter writer(path_);
    for (int i = 0; i < 4; ++i) writer.append(7, "payload " + std::to_string(i));
  }
  const std::string all = bytes();
  const std::size_t size = all.size() / 4;
  for (std::size_t cut = 0; cut < all.size(); ++cut) {
    set_bytes(all.substr(0, cut));
    bool whole = false;
    EXPECT_EQ(payloads(&whole).size(), cut / size);
    EXPECT_TRUE(whole);
    LogWriter writer(path_);
    EXPECT_EQ(writer.append(7, "after"), cut / size + 1);
    EXPECT_EQ(payloads().back(), "after");
  }
}

TEST_F(RecordLog, FlippedBitAnywhereIsNeverTakenForData) {
  {
    LogWriter writer(path_);
    for (int i = 0; i < 3; ++i) writer.append(7, "payload " + std::to_string(i));
  }
  const std::string all = bytes();
  const std::size_t size = all.size() / 3;
  for (std::size_t bit = 0; bit < all.size() * 8; ++bit) {
    std::string damaged = all;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    set_bytes(damaged);
    bool whole = true;
    const std::size_t record = bit / 8 / size;
    EXPECT_EQ(payloads(&whole).size(), record) << "bit " << bit;
    EXPECT_EQ(whole, record == 2) << "bit " << bit;  // the last record may be one that was torn
  }
}

TEST_F(RecordLog, WithZeroedEndIsCutThere) {
  {
    LogWriter writer(path_);
    writer.append(0, "kept");
  }
  set_bytes(bytes() + std::string(4096, '\0'));  // what a crash of the machine leaves
  bool whole = false;
  EXPECT_EQ(payloads(&whole), std::vector<std::string>{"kept"});
  EXPECT_TRUE(whole);
}

TEST_F(RecordLog, DamagedInTheMiddleIsNotWrittenTo) {
  {
    LogWriter writer(path_);
    for (int i = 0; i < 3; ++i) writer.append(0, "payload");
  }
  std::string damaged = bytes();
  damaged[24] = '?';
  set_bytes(damaged);
  EXPECT_THROW(LogWriter{path_}, std::system_error);
  EXPECT_EQ(bytes(), damaged);
}

TEST_F(RecordLog, RandomBytesAreSurvived) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    std::string bytes(random() % 500, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    set_bytes(bytes);
    EXPECT_TRUE(payloads().empty());
  }
}

TEST_F(RecordLog, FullDiskLeavesWholeRecords) {
  LogWriter writer(path_);
  writer.append(0, std::string(1000, 'a'));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);  // the limit then shows as EFBIG after a short write, as a full disk does
  rlimit small = before;
  small.rlim_cur = 1500;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(writer.append(0, std::string(1000, 'b')), std::system_error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(writer.append(0, "room again"), 2U);
  EXPECT_EQ(payloads(), (std::vector<std::string>{std::string(1000, 'a'), "room again"}));
}

// A reader may see a part of a record, and whole ones behind it a moment later: that is no damage.
TEST_F(RecordLog, IsReadWhileItIsWritten) {
  constexpr std::size_t records = 20'000;
  std::jthread writer([&] {
    LogWriter log(path_);
    for (std::size_t i = 0; i < records; ++i) log.append(1, std::string(i % 5000, 'x'));
  });
  LogReader reader(path_);
  std::size_t last = 0;
  while (last < records) {
    ASSERT_TRUE(reader.read([&](const LogRecord& record) { EXPECT_EQ(record.sequence, ++last); })) << "behind " << last;
  }
}

}  // namespace
}  // namespace bedflow
