#include "transfer.h"

#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <system_error>
#include <thread>

#include "record_log.h"
#include "terminal.h"

namespace bedflow::client {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// What has been got of a file: FILE.part and FILE.part.seal, "STEP SEAL".
class Part {
 public:
  explicit Part(const fs::path& file) : path_(file.string() + ".part"), seal_path_(path_.string() + ".seal") {
    std::ifstream seal(seal_path_);
    if (seal >> step_ >> seal_ && fs::exists(path_)) have_ = fs::file_size(path_);
    if (have_ == 0) seal_.clear();
  }
  ~Part() {
    if (file_ >= 0) ::close(file_);
  }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  std::uint64_t have() const { return have_; }
  const std::string& seal() const { return seal_; }
  std::uint64_t step() const { return step_; }

  void begin(const v1::DownloadCheckpointResponse& head) {
    if (seal_.empty()) {
      seal_ = head.seal(), step_ = head.step();
      if (!(std::ofstream(seal_path_) << step_ << ' ' << seal_ << '\n').flush()) full();
    }
    if (file_ < 0) file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (have_ == 0 ? O_TRUNC : 0), 0644);
    if (file_ < 0) throw std::system_error(errno, std::generic_category(), path_.string());
  }
  void add(const std::string& data) {
    for (std::size_t done = 0; done < data.size();) {
      const auto put = ::pwrite(file_, data.data() + done, data.size() - done, static_cast<off_t>(have_));
      if (put < 0 && errno == EINTR) continue;
      if (put < 0) full();
      done += static_cast<std::size_t>(put);
      have_ += static_cast<std::uint64_t>(put);
    }
  }
  void forget() {
    fs::remove(path_);
    fs::remove(seal_path_);
    seal_.clear();
    have_ = 0;
  }
  void finish(const fs::path& file) {
    if (::fsync(file_) != 0) full();
    fs::rename(path_, file);
    fs::remove(seal_path_);
  }

 private:
  [[noreturn]] void full() const {
    throw Failure(Exit::limit, "the file " + path_.string() + " cannot be written: " + std::system_category().message(errno),
                  "make room and try again: what is there is gone on with");
  }

  fs::path path_, seal_path_;
  std::string seal_;
  std::uint64_t have_ = 0, step_ = 0;
  int file_ = -1;
};

v1::DownloadCheckpointRequest request_of(const v1::CheckpointName& name, const std::optional<Part>& part) {
  v1::DownloadCheckpointRequest request;
  *request.mutable_name() = name;
  if (!part || part->seal().empty()) return request;
  request.mutable_name()->set_step(part->step());
  request.set_offset(part->have());
  request.set_seal(part->seal());
  return request;
}

void take(Part& part, const v1::DownloadCheckpointResponse& response) {
  if (response.offset() != part.have() || crc32c(response.data()) != response.crc32c()) {
    throw Failure(Exit::corrupt, "the part at byte " + std::to_string(response.offset()) + " came damaged or out of turn",
                  "try again: what is there is gone on with");
  }
  part.add(response.data());
}

}  // namespace

fs::path download_checkpoint(const Connection& connection, const v1::CheckpointName& name, const fs::path& wanted,
                             double away_seconds, const TransferCalls& calls) {
  fs::path file = wanted;
  std::optional<Part> part;
  if (!file.empty()) part.emplace(file);
  if (part && part->have() > 0) calls.note("going on at byte " + std::to_string(part->have()) + " of " + file.string() + ".part");
  std::uint64_t bytes = 0;
  for (auto last_heard = Clock::now();;) {
    grpc::ClientContext context;
    const auto reader = connection.stub().DownloadCheckpoint(&context, request_of(name, part));
    v1::DownloadCheckpointResponse response;
    while (reader->Read(&response)) {
      if (response.has_seal()) {
        if (file.empty()) file = response.file();
        if (!part) part.emplace(file);
        bytes = response.bytes();
        if (part->seal() != response.seal() && part->have() > 0) part->forget();  // an older one of the same name: from the start
        if (response.offset() != part->have()) {                                  // it is the whole that is wanted now
          context.TryCancel();
          break;
        }
        part->begin(response);
      }
      take(*part, response);
      last_heard = Clock::now();
      calls.progress(part->have(), bytes);
    }
    if (part && bytes > 0 && part->have() == bytes) break;
    const auto status = reader->Finish();
    const auto failure = connection.failure_of(status);
    v1::ErrorDetail detail;
    detail.ParseFromString(status.error_details());
    if (detail.reason() == "CHECKPOINT_CHANGED" && part && !wanted.empty()) {
      calls.note(std::string(failure.what()) + "; beginning again");
      part->forget();
      continue;
    }
    const bool away = status.error_code() == grpc::UNAVAILABLE || status.error_code() == grpc::CANCELLED || status.ok();
    if (!away || Clock::now() - last_heard > std::chrono::duration<double>(away_seconds)) throw failure;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  part->finish(file);
  return file;
}

v1::Job import_checkpoint(const Connection& connection, const fs::path& file, const v1::ImportCheckpointRequest::Head& head,
                          const TransferCalls& calls) {
  constexpr std::size_t part_bytes = 1 << 20;
  std::ifstream from(file, std::ios::binary);
  if (!from) throw Failure(Exit::not_found, "the file " + file.string() + " cannot be read");
  v1::Job job;
  grpc::ClientContext context;
  const auto writer = connection.stub().ImportCheckpoint(&context, &job);
  v1::ImportCheckpointRequest request;
  *request.mutable_head() = head;
  request.mutable_head()->set_bytes(fs::file_size(file));
  bool taken = writer->Write(request);
  std::string data(part_bytes, '\0');
  for (std::uint64_t offset = 0; taken && offset < request.head().bytes();) {
    from.read(data.data(), static_cast<std::streamsize>(data.size()));
    const auto got = static_cast<std::size_t>(from.gcount());
    if (got == 0) break;
    v1::ImportCheckpointRequest part;
    part.set_offset(offset);
    part.set_data(data.substr(0, got));
    part.set_crc32c(crc32c(part.data()));
    taken = writer->Write(part);
    offset += got;
    calls.progress(offset, request.head().bytes());
  }
  writer->WritesDone();
  if (const auto status = writer->Finish(); !status.ok()) throw connection.failure_of(status);
  return job;
}

}  // namespace bedflow::client
