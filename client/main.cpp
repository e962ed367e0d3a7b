// bedflow: the command-line client.
#include <google/protobuf/stubs/common.h>

#include <cstdlib>

#include "command_line.h"

namespace bedflow::client {

namespace {

int run(int argc, char** argv) {
  Program program;
  program.words.assign(argv + 1, argv + argc);
  const auto line = command_line(program);
  CLI::App& app = *line;
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success);
    const auto words = app.remaining();
    if (!asked_for_help && app.get_subcommands().empty() && !words.empty()) {
      throw Failure(Exit::usage, "there is no verb \"" + words.front() + "\"", "bedflow --help");
    }
    app.exit(error);
    return static_cast<int>(asked_for_help ? Exit::ok : Exit::usage);
  }
  return static_cast<int>(program.verb());
}

}  // namespace
}  // namespace bedflow::client

int main(int argc, char** argv) {
  setenv("GRPC_VERBOSITY", "NONE", 0);  // what goes wrong is told by us, once
  try {
    return bedflow::client::run(argc, argv);
  } catch (const bedflow::client::Failure& failure) {
    bedflow::client::print_failure(failure);
    return static_cast<int>(failure.code);
  } catch (const std::exception& error) {
    bedflow::client::print_failure({bedflow::client::Exit::other, error.what()});
    return static_cast<int>(bedflow::client::Exit::other);
  }
}
