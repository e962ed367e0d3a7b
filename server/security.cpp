#include "security.h"

#include <sys/random.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <system_error>

namespace bedflow::server {
namespace {

namespace fs = std::filesystem;

bool is_lower_hex(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool is_lower(char c) {
  return c >= 'a' && c <= 'z';
}
bool is_letter(char c) {
  return is_lower(c) || (c >= 'A' && c <= 'Z');
}

// 127.a.b.c in full; anything shorter or named is left to no resolver.
bool is_loopback_v4(std::string_view host) {
  int parts = 0;
  while (true) {
    int number = -1;
    const auto [end, error] = std::from_chars(host.data(), host.data() + host.size(), number);
    if (error != std::errc() || number < 0 || number > 255 || (parts == 0 && number != 127)) return false;
    host.remove_prefix(static_cast<std::size_t>(end - host.data()));
    if (++parts == 4) return host.empty();
    if (host.empty() || host.front() != '.') return false;
    host.remove_prefix(1);
  }
}

// A name, an IPv4 address, or an IPv6 address in brackets.
bool is_host(std::string_view host) {
  const auto is_in_name = [](char c) { return is_letter(c) || is_digit(c) || c == '.' || c == '-'; };
  const auto is_in_v6 = [](char c) { return is_lower_hex(c) || is_digit(c) || c == ':' || c == '.'; };
  if (host.size() > 2 && host.front() == '[' && host.back() == ']')
    return std::all_of(host.begin() + 1, host.end() - 1, is_in_v6);
  return !host.empty() && host.size() <= 253 && std::all_of(host.begin(), host.end(), is_in_name);
}

std::string unix_address(const std::string& wanted) {
  const fs::path path = fs::absolute(wanted.substr(5)).lexically_normal();
  if (path.string().size() >= sizeof(sockaddr_un{}.sun_path)) {
    throw std::invalid_argument(path.string() + " is too long for a socket (at most " +
                                std::to_string(sizeof(sockaddr_un{}.sun_path) - 1) +
                                " characters); use --listen unix:PATH with a shorter one");
  }
  struct stat folder {};
  if (::stat(path.parent_path().c_str(), &folder) != 0) {
    throw std::invalid_argument("the folder " + path.parent_path().string() + " of the socket does not exist");
  }
  if ((folder.st_mode & 0077) != 0 || folder.st_uid != ::geteuid()) {
    throw std::invalid_argument("the folder " + path.parent_path().string() +
                                " of the socket is open to others; use one of mode 0700 that is yours (chmod 700)");
  }
  return "unix:" + path.string();
}

}  // namespace

std::string listen_address(const std::string& wanted, bool has_tls) {
  if (wanted.starts_with("unix:")) return unix_address(wanted);
  const auto colon = wanted.rfind(':');
  const std::string host = wanted.substr(0, colon);
  int port = -1;
  if (colon != std::string::npos) {
    const char* end = wanted.data() + wanted.size();
    const auto [stop, error] = std::from_chars(wanted.data() + colon + 1, end, port);
    if (error != std::errc() || stop != end) port = -1;
  }
  if (port < 0 || port > 65535) {
    throw std::invalid_argument("'" + printable(wanted) +
                                "' is not an address: use unix:PATH or 127.0.0.1:PORT, or HOST:PORT with TLS");
  }
  if (host == "localhost") return "127.0.0.1:" + std::to_string(port);
  if (host == "[::1]" || is_loopback_v4(host)) return wanted;
  if (has_tls && is_host(host)) return wanted;
  throw std::invalid_argument(
      "'" + printable(wanted) +
      "' is not a loopback address: nothing listens beyond the machine without TLS and authentication; "
      "add --tls-certificate FILE --tls-key FILE (callers then need tokens: bedflow server token create), "
      "or use 127.0.0.1:PORT or unix:PATH, and an SSH tunnel from elsewhere");
}

void make_private(const fs::path& folder) {
  fs::create_directories(folder.parent_path());
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
    throw std::system_error(errno, std::generic_category(), folder.string());
  if (::chmod(folder.c_str(), 0700) != 0)
    throw std::system_error(errno, std::generic_category(), "chmod 0700 " + folder.string());
}

bool is_job_id(std::string_view id) {
  return id.size() == 14 && id.starts_with("j-") && std::all_of(id.begin() + 2, id.end(), is_lower_hex);
}

bool is_request_id(std::string_view id) {
  return id.size() >= 8 && id.size() <= 64 &&
         std::all_of(id.begin(), id.end(), [](char c) { return is_letter(c) || is_digit(c) || c == '-'; });
}

bool is_label_key(std::string_view key) {
  const auto later = [](char c) { return is_lower(c) || is_digit(c) || c == '.' || c == '_' || c == '/' || c == '-'; };
  return !key.empty() && key.size() <= 63 && (is_lower(key.front()) || is_digit(key.front())) &&
         std::all_of(key.begin(), key.end(), later);
}

bool is_owner(std::string_view name) {
  return is_label_key(name) && name.find('/') == name.npos;
}

std::string printable(std::string_view text) {
  static constexpr std::string_view digits = "0123456789abcdef";
  std::string shown;
  for (const char c : text.substr(0, 80)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7f) {
      shown += c;
    } else {
      shown += {'\\', 'x', digits[byte >> 4], digits[byte & 15]};
    }
  }
  return text.size() > 80 ? shown + "..." : shown;
}

std::string new_job_id() {
  static constexpr std::string_view digits = "0123456789abcdef";
  std::array<unsigned char, 6> bytes;
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::generic_category(), "getrandom");
  }
  std::string id = "j-";
  for (const unsigned char byte : bytes) id += {digits[byte >> 4], digits[byte & 15]};
  return id;
}

}  // namespace bedflow::server
