// A job's folder, by the contract on top of job.proto: its paths, and what is read of its small files.
#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bedflow/v1/job.pb.h"
#include "durable_file.h"

namespace bedflow::server {

class JobFolder {
 public:
  explicit JobFolder(std::filesystem::path root) : root_(std::move(root)) {}

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path case_file() const { return root_ / "case.txtpb"; }
  std::filesystem::path packing() const { return root_ / "packing.h5"; }
  std::filesystem::path summary() const { return root_ / "summary.json"; }
  std::filesystem::path spec() const { return root_ / "job.txtpb"; }
  std::filesystem::path events() const { return root_ / "events.log"; }
  std::filesystem::path statistics() const { return root_ / "statistics.log"; }
  std::filesystem::path heartbeat() const { return root_ / "heartbeat"; }
  std::filesystem::path control() const { return root_ / "control.txtpb"; }
  std::filesystem::path checkpoints() const { return root_ / "checkpoints"; }
  std::filesystem::path checkpoint(std::uint64_t step) const { return checkpoints() / checkpoint_name(step); }
  // Beside a checkpoint that stays when newer ones come.
  std::filesystem::path kept_mark(std::uint64_t step) const { return checkpoints() / (checkpoint_name(step) + ".kept"); }
  std::filesystem::path pinned() const { return root_ / "pinned"; }
  std::filesystem::path pin(std::uint64_t step) const { return pinned() / checkpoint_name(step); }
  std::filesystem::path attempts() const { return root_ / "attempts"; }
  std::filesystem::path attempt(std::uint32_t epoch) const { return attempts() / std::to_string(epoch); }
  std::filesystem::path lock(std::uint32_t epoch) const { return attempt(epoch) / "lock"; }
  std::filesystem::path taken(std::uint32_t epoch) const { return attempt(epoch) / "taken"; }
  std::filesystem::path batch_script(std::uint32_t epoch) const { return attempt(epoch) / "batch.sh"; }
  std::filesystem::path runner(std::uint32_t epoch) const { return attempt(epoch) / "runner.txtpb"; }
  std::filesystem::path exit_record(std::uint32_t epoch) const { return attempt(epoch) / "exit.txtpb"; }
  std::filesystem::path output_log(std::uint32_t epoch) const { return attempt(epoch) / "stdout.log"; }
  std::filesystem::path error_log(std::uint32_t epoch) const { return attempt(epoch) / "stderr.log"; }

  static std::string checkpoint_name(std::uint64_t step);
  std::vector<std::uint64_t> checkpoint_steps() const;  // newest first, by name; nothing is opened
  std::vector<std::uint64_t> pinned_steps() const;      // the same of those that are pinned
  std::vector<std::uint32_t> epochs() const;            // attempts that have a folder, in order

  // Replaces control.txtpb by the command, with a sequence number above the last. Throws std::system_error.
  void command(v1::Control::Command command, bool skip_checkpoint = false) const;

 private:
  std::filesystem::path root_;
};

// A job's folder that is being put together, gone with its owner unless it was renamed away.
class DraftFolder {
 public:
  explicit DraftFolder(std::filesystem::path path);  // creates it; throws std::system_error
  ~DraftFolder();
  DraftFolder(const DraftFolder&) = delete;
  DraftFolder& operator=(const DraftFolder&) = delete;

  const JobFolder folder;
};

using bedflow::write_durably;

// A second name of a file, unless there is one of that name already; where the file system has no second names, a second file.
// Throws std::filesystem::filesystem_error.
void put_beside(const std::filesystem::path& file, const std::filesystem::path& name);

// False when the file is not there or is no such message.
bool read_message(const std::filesystem::path& path, google::protobuf::Message& message);
std::string read_text(const std::filesystem::path& path);                            // empty when it cannot be read
std::string last_lines(const std::filesystem::path& path, std::size_t bytes = 600);  // of a log, for messages

}  // namespace bedflow::server
