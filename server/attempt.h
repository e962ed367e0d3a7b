// One attempt of a job as its folder shows it: what the engine has said, whether it still breathes, and how it ended. The same
// for an attempt that this server started and for one that it found.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "folder.h"
#include "follow.h"
#include "record_log.h"
#include "states.h"

namespace bedflow::server {

// What a living engine changes at least once a second. Only a change says something: the clocks of the machines may differ.
std::string heartbeat_of(const JobFolder& folder);

class Attempt {
 public:
  Attempt(JobFolder folder, std::uint32_t epoch);

  // Reads what is new and tells it to the job's watchers, if there are any; true when there is something.
  bool look(const std::shared_ptr<Feed>& feed = nullptr);

  std::uint32_t epoch() const { return epoch_; }
  const JobFolder& folder() const { return folder_; }
  bool has_started() const { return started_; }
  bool has_gone_on() const { return checkpoint_.epoch() == epoch_ && checkpoint_.checkpoint().step() > start_step_; }
  const std::optional<v1::Stopped>& stopped() const { return stopped_; }
  const v1::Progress& progress() const { return progress_; }  // newest of the job
  std::uint64_t last_sequence() const { return last_sequence_; }
  const v1::Event& checkpoint() const { return checkpoint_; }   // the newest CheckpointWritten, whoever wrote it
  void expect() { heard_ = std::chrono::steady_clock::now(); }  // it cannot give signs of life yet
  // Since the engine's last sign of life, or since this began to look or expects it.
  std::chrono::steady_clock::duration silence() const { return std::chrono::steady_clock::now() - heard_; }

  std::int64_t ended_unix_nanos() const;  // by the exit record; now if there is none
  // How it ended, once nothing of it lives: the engine's own word; else the exit record; else it was killed.
  Ending ending() const;

 private:
  void take(const v1::Event& event);

  JobFolder folder_;
  std::uint32_t epoch_;
  LogReader reader_;
  bool started_ = false;
  std::uint64_t start_step_ = 0;
  bool damaged_ = false;
  std::optional<v1::Stopped> stopped_;
  v1::Progress progress_;
  v1::Event checkpoint_;
  std::uint64_t last_sequence_ = 0;
  std::string heartbeat_;
  std::chrono::steady_clock::time_point heard_ = std::chrono::steady_clock::now();
};

}  // namespace bedflow::server
