// A bedflowd of the client's own, on a socket in its data folder, for `bedflow run`. It outlives the client only as long as jobs
// run.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

namespace bedflow::client {

class EmbeddedServer {
 public:
  // Uses the server that already serves this folder, or starts one and waits until it answers. Throws Failure with what the
  // server said.
  explicit EmbeddedServer(const std::filesystem::path& data);
  ~EmbeddedServer();  // ends the server that was started here, unless jobs run
  EmbeddedServer(const EmbeddedServer&) = delete;
  EmbeddedServer& operator=(const EmbeddedServer&) = delete;

  const std::string& address() const { return address_; }
  const std::filesystem::path& data() const { return data_; }

  // Starts it again when it has died. Throws Failure when it dies again and again.
  void revive();
  void leave() { left_ = true; }  // do not end it: it ends by itself with its last job

 private:
  bool answers(double seconds) const;
  bool child_ended();
  void start();
  void wait_until_ready();

  std::filesystem::path data_, log_;
  std::string address_;
  pid_t child_ = -1;  // -1: none of ours
  int starts_ = 0;
  bool left_ = false;
};

}  // namespace bedflow::client
