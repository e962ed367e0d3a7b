// The sign that the ranks advance: a count in a file of the job folder, rewritten about twice a second by rank 0. Who follows it
// looks whether it changes; the clock of the file system says nothing. The file is closed each time, or other machines would see
// it late on a network file system.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <thread>

namespace bedflow {

class Heartbeat {
 public:
  // On the other ranks (not here) every call does nothing.
  Heartbeat(bool here, std::filesystem::path file, std::uint32_t epoch);

  void beat();   // at most about twice a second, from any thread
  void leave();  // never again

  // Beats in place of the ranks while they are in one long call after another that do not come back here: reading and writing
  // files. Not for longer than `most`: a rank that has frozen there must be found in the end.
  class Meanwhile {
   public:
    Meanwhile(Heartbeat& heartbeat, std::chrono::duration<double> most);
    ~Meanwhile();
    Meanwhile(const Meanwhile&) = delete;
    Meanwhile& operator=(const Meanwhile&) = delete;

   private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool over_ = false;
    std::thread thread_;
  };

 private:
  std::filesystem::path file_;
  std::uint32_t epoch_;
  std::mutex mutex_;
  bool silent_;
  std::uint64_t count_ = 0;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace bedflow
