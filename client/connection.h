// The gRPC calls, one at a time, each with a deadline; a refused call becomes a Failure with its exit code. What leaves the
// machine goes over TLS, with the token of the context.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>

#include "bedflow/v1/service.grpc.pb.h"
#include "contexts.h"
#include "failure.h"

namespace bedflow::client {

using Stub = v1::JobService::Stub;

// unix:$XDG_STATE_HOME/bedflow/bedflowd.sock, or below ~/.local/state: where a bedflowd without options listens.
std::string default_address();

class Connection {
 public:
  // Nothing is sent yet; but the files that a context names are read, and Failure thrown where they cannot serve.
  explicit Connection(const ServerChoice& choice) : Connection(choice.resolve()) {}
  explicit Connection(const v1::Context& context);
  // A gRPC target of this machine: "unix:/path/to/socket" or "127.0.0.1:port".
  explicit Connection(const std::string& address);

  template <class Request, class Response>
  using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);

  // Waits at most so many seconds. Throws Failure.
  template <class Request, class Response>
  Response call(Method<Request, Response> method, const Request& request, double seconds = 10) const {
    Response response;
    const auto status =
        run([&](grpc::ClientContext* context) { return (stub_.get()->*method)(context, request, &response); }, seconds);
    if (!status.ok()) throw failure_of(status);
    return response;
  }

  v1::Job get_job(const std::string& id, bool with_case = false) const;

  void set_quiet() { quiet_ = true; }  // nobody is told that an answer is waited for

  Stub& stub() const { return *stub_; }
  const std::string& address() const { return address_; }
  Failure failure_of(const grpc::Status& status) const;

 private:
  using Attempt = std::function<grpc::Status(grpc::ClientContext*)>;
  grpc::Status run(const Attempt& attempt, double seconds) const;

  v1::Context context_;
  std::string address_;
  bool quiet_ = false;
  std::unique_ptr<Stub> stub_;
};

}  // namespace bedflow::client
