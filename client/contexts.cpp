#include "contexts.h"

#include <fcntl.h>
#include <google/protobuf/text_format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "connection.h"
#include "durable_file.h"
#include "failure.h"
#include "open_file.h"
#include "token.h"

namespace bedflow::client {

namespace fs = std::filesystem;

namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

// What it is and what it holds, from one and the same open file.
std::string read_small(const std::string& path, const std::string& what, bool is_private) {
  const OpenFile file(path, O_RDONLY);
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0)
    throw Failure(Exit::usage, what + " " + path + " cannot be read: " + std::strerror(errno), "bedflow context show");
  if (!S_ISREG(status.st_mode)) throw Failure(Exit::usage, what + " " + path + " is not a file", "bedflow context show");
  if (is_private && (status.st_mode & 0077) != 0)
    throw Failure(Exit::not_allowed, what + " " + path + " can be read by others, and is not used", "chmod 600 " + path);
  if (is_private && status.st_uid != ::geteuid())
    throw Failure(Exit::not_allowed, what + " " + path + " belongs to another user, and is not used", "cp it, and chmod 600");
  constexpr std::size_t longest = 1 << 20;
  std::string text;
  std::array<char, 4096> part;
  for (ssize_t got = 0; (got = ::read(file.get(), part.data(), part.size())) > 0 && text.size() < longest;)
    text.append(part.data(), static_cast<std::size_t>(got));
  return text;
}

}  // namespace

fs::path contexts_file() {
  const std::string config = variable("XDG_CONFIG_HOME");
  const std::string home = variable("HOME");
  return (config.empty() ? fs::path(home.empty() ? "/" : home) / ".config" : fs::path(config)) / "bedflow/contexts.txtpb";
}

v1::Contexts read_contexts() {
  v1::Contexts contexts;
  std::ifstream file(contexts_file(), std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  if (!google::protobuf::TextFormat::ParseFromString(text, &contexts))
    throw Failure(Exit::usage, contexts_file().string() + " is damaged", "mend or remove it; bedflow context add NAME ...");
  return contexts;
}

void write_contexts(const v1::Contexts& contexts) {
  const auto path = contexts_file();
  try {
    fs::create_directories(path.parent_path());
    write_durably(path, contexts);
  } catch (const std::system_error& error) {
    throw Failure(Exit::other, path.string() + " cannot be written: " + error.code().message(),
                  "XDG_CONFIG_HOME names another folder");
  }
}

const v1::Context& find_context(const v1::Contexts& contexts, const std::string& name) {
  std::string there;
  for (const auto& context : contexts.contexts()) {
    if (context.name() == name) return context;
    there += (there.empty() ? "" : ", ") + context.name();
  }
  throw Failure(Exit::not_found,
                "there is no context \"" + name + "\"" + (there.empty() ? "; there are none" : "; there are " + there),
                "bedflow context add " + name + " --server ADDRESS");
}

v1::Context ServerChoice::resolve() const {
  if (!address.empty() && !context.empty())
    throw Failure(Exit::usage, "--server and --context both name a server", "bedflow context show " + context);
  v1::Context chosen;
  std::string name = context;
  std::string server = address;
  if (name.empty() && server.empty()) name = variable("BEDFLOW_CONTEXT");
  if (name.empty() && server.empty()) server = variable("BEDFLOW_SERVER");
  if (!server.empty()) {
    chosen.set_server(server);
    return chosen;
  }
  const auto contexts = read_contexts();
  if (name.empty()) name = contexts.current();
  if (!name.empty()) return find_context(contexts, name);
  chosen.set_server(default_address());
  return chosen;
}

std::string ServerChoice::words() const {
  return !context.empty() ? " --context " + context : !address.empty() ? " --server " + address : "";
}

bool is_near(const std::string& address) {
  if (address.starts_with("unix:")) return true;
  const std::string host = address.substr(0, address.rfind(':'));
  const bool is_v4 = host.starts_with("127.") && host.find_first_not_of("0123456789.") == host.npos;
  return host == "localhost" || host == "[::1]" || is_v4;
}

bool wants_tls(const v1::Context& context) {
  return !is_near(context.server()) || context.has_ca() || context.has_certificate() || context.has_key() || context.has_token();
}

std::string read_pem(const std::string& path, bool is_private) {
  const std::string what = is_private ? "the key" : "the certificate";
  auto text = read_small(path, what, is_private);
  if (text.find("-----BEGIN ") == text.npos)
    throw Failure(Exit::usage, what + " " + path + " is not in PEM (-----BEGIN ...)", "bedflow context show");
  return text;
}

std::string read_token_file(const std::string& path) {
  auto text = read_small(path, "the token file", true);
  text.erase(text.find_last_not_of(" \t\r\n") + 1);
  if (!read_token(text))
    throw Failure(Exit::usage, "the token file " + path + " has no token of bedflow (bedflow_..._...) and nothing else",
                  "bedflow server token create OWNER --out FILE");
  return text;
}

}  // namespace bedflow::client
