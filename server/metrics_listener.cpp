#include "metrics_listener.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/system/system_error.hpp>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <thread>
#include <utility>

namespace bedflow::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Stream = beast::basic_stream<asio::generic::stream_protocol>;

constexpr auto longest = std::chrono::seconds(5);  // for a request, and for its answer
constexpr int most_sessions = 16;                  // at once; more wait to be accepted

// One request, one answer, one connection.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(asio::generic::stream_protocol::socket socket, const std::function<std::string()>& text, std::function<void()> ended)
      : stream_(std::move(socket)), text_(text), ended_(std::move(ended)) {
    parser_.header_limit(8192);
    parser_.body_limit(0);
  }
  ~Session() { ended_(); }

  void begin() {
    stream_.expires_after(longest);
    http::async_read_header(stream_, buffer_, parser_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
      const bool is_no_http = error.category() == http::make_error_code(http::error::bad_method).category();
      if (error && (!is_no_http || error == http::error::end_of_stream)) return;  // gone, or too slow
      self->answer(!error);
    });
  }

 private:
  void answer(bool is_request) {
    const auto& request = parser_.get();
    const bool is_get = is_request && (request.method() == http::verb::get || request.method() == http::verb::head);
    response_.version(11);
    response_.keep_alive(false);
    response_.set(http::field::content_type, "text/plain; charset=utf-8");
    response_.result(http::status::bad_request);
    if (is_request && !is_get) response_.result(http::status::method_not_allowed);
    if (is_get && request.target() != "/metrics") {
      response_.result(http::status::not_found);
      response_.body() = "the metrics are at /metrics\n";
    }
    if (is_get && request.target() == "/metrics") {
      response_.result(http::status::ok);
      response_.set(http::field::content_type, "text/plain; version=0.0.4; charset=utf-8");
      try {
        response_.body() = text_();
      } catch (const std::exception& failure) {
        response_.result(http::status::internal_server_error);
        response_.body() = std::string(failure.what()) + "\n";
      }
    }
    response_.prepare_payload();
    if (request.method() == http::verb::head) response_.body().clear();
    stream_.expires_after(longest);
    http::async_write(stream_, response_, [self = shared_from_this()](const beast::error_code&, std::size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(asio::socket_base::shutdown_send, ignored);
    });
  }

  Stream stream_;
  const std::function<std::string()>& text_;
  const std::function<void()> ended_;
  beast::flat_buffer buffer_{16384};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

asio::ip::tcp::endpoint tcp_endpoint(const std::string& address, bool beyond) {
  const auto colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host == "localhost") host = "127.0.0.1";
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  boost::system::error_code wrong;
  const auto ip = asio::ip::make_address(host, wrong);
  int port = -1;
  if (colon != address.npos && address.find_first_not_of("0123456789", colon + 1) == address.npos && address.size() - colon <= 6)
    port = std::atoi(address.c_str() + colon + 1);
  if (wrong || port < 0 || port > 65535)
    throw std::invalid_argument("--metrics '" + address + "' is no address: unix:PATH, 127.0.0.1:PORT or none");
  if (!ip.is_loopback() && !beyond) {
    throw std::invalid_argument("--metrics " + address +
                                " is beyond this machine, and metrics have neither TLS nor authentication: " +
                                "say --metrics-beyond-loopback if the network around it is to be trusted");
  }
  return {ip, static_cast<std::uint16_t>(port)};
}

}  // namespace

struct MetricsListener::Parts {
  std::string address;
  std::function<std::string()> text;
  int sessions = 0;
  bool waits = false;    // for one of them to end
  bool closing = false;  // what the context still holds goes with it
  asio::io_context context{1};
  asio::basic_socket_acceptor<asio::generic::stream_protocol> acceptor{context};
  asio::basic_waitable_timer<std::chrono::steady_clock> pause{context};
  std::string socket;  // to remove at the end
  std::thread thread;

  void accept() {
    waits = sessions >= most_sessions;
    if (waits) return;
    acceptor.async_accept([this](const boost::system::error_code& error, asio::generic::stream_protocol::socket connection) {
      if (error == asio::error::operation_aborted) return;
      if (!error) {
        ++sessions;
        std::make_shared<Session>(std::move(connection), text, [this] { ended(); })->begin();
        return accept();
      }
      pause.expires_after(std::chrono::seconds(1));  // no more open files, say
      pause.async_wait([this](const boost::system::error_code& stopped) {
        if (!stopped) accept();
      });
    });
  }
  void ended() {
    --sessions;
    if (waits && !closing) accept();
  }
};

MetricsListener::MetricsListener(const std::string& address, bool beyond, std::function<std::string()> text)
    : parts_(std::make_unique<Parts>()) {
  Parts& parts = *parts_;
  parts.address = address;
  parts.text = std::move(text);
  const auto listen = [&](const auto& endpoint) {
    const asio::generic::stream_protocol protocol(endpoint.protocol());
    parts.acceptor.open(protocol);
    if (endpoint.protocol().family() != AF_UNIX) parts.acceptor.set_option(asio::socket_base::reuse_address(true));
    parts.acceptor.bind(endpoint);
    parts.acceptor.listen();
  };
  if (address.starts_with("unix:")) {
    parts.socket = address.substr(5);
    ::unlink(parts.socket.c_str());  // of a server before this one
    listen(asio::local::stream_protocol::endpoint(parts.socket));
    ::chmod(parts.socket.c_str(), 0660);
  } else {
    listen(tcp_endpoint(address, beyond));
    const auto colon = address.rfind(':');
    asio::ip::tcp::endpoint bound;
    const auto local = parts.acceptor.local_endpoint();
    std::memcpy(bound.data(), local.data(), local.size());
    parts.address = address.substr(0, colon + 1) + std::to_string(bound.port());
  }
  parts.accept();
  parts.thread = std::thread([&parts] { parts.context.run(); });
}

MetricsListener::~MetricsListener() {
  parts_->context.stop();
  parts_->thread.join();
  parts_->closing = true;
  if (!parts_->socket.empty()) ::unlink(parts_->socket.c_str());
}

const std::string& MetricsListener::address() const {
  return parts_->address;
}

}  // namespace bedflow::server
