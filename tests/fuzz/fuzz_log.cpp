// Any bytes as a job's log. The first byte chooses: the file itself (behind it), or payloads of records whose frames are good, so
// that what lies within them is reached too: each a length of two bytes, and so many bytes.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

#include "bedflow/v1/job.pb.h"
#include "record_log.h"
#include "statistics_file.h"

namespace {

// A file in memory, by a name.
class Scratch {
 public:
  Scratch() : file_(::memfd_create("log", MFD_CLOEXEC)), path_("/proc/self/fd/" + std::to_string(file_)) {}
  ~Scratch() { ::close(file_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }
  void write(std::string_view bytes) const {
    if (::write(file_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) std::abort();
  }

 private:
  int file_;
  std::filesystem::path path_;
};

void write_records(const Scratch& scratch, std::string_view payloads) {
  bedflow::LogWriter writer(scratch.path());
  while (payloads.size() >= 2) {
    const std::size_t wanted = static_cast<unsigned char>(payloads[0]) + 256U * static_cast<unsigned char>(payloads[1]);
    const auto payload = payloads.substr(2, wanted);
    writer.append(1, payload);
    payloads.remove_prefix(2 + payload.size());
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Scratch scratch;
  if (data[0] == 'r') {
    write_records(scratch, bytes);
  } else {
    scratch.write(bytes);
  }
  std::uint64_t last = 0;
  bedflow::LogReader reader(scratch.path());
  reader.read([&](const bedflow::LogRecord& record) {
    if (record.sequence != last + 1) std::abort();  // gapless, whatever the file
    last = record.sequence;
    bedflow::v1::Event event;
    if (event.ParseFromString(record.payload)) (void)event.ByteSizeLong();
  });
  try {
    bedflow::StatisticsLog log(scratch.path());
    log.update();
    log.series();
    log.answer({});
    log.answer({.from_time = 0.1, .to_step = 5, .most = 3});
  } catch (const std::runtime_error&) {  // a damaged log
  }
  return 0;
}
