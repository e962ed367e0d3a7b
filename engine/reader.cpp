// bedflow-reader: answers one question about one checkpoint file and ends. It is what opens files that came from outside: a
// process of its own, with little memory and little time, and without MPI. A crash of it is an answer too.
//
// Exit codes: 0; 2 the question is wrong; otherwise those of bedflow-engine. What went wrong is told on stderr.
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>

#include "base/stop.h"
#include "checkpoint/checkpoint.h"
#include "fields/quantities.h"
#include "import_checkpoint.h"
#include "report/field_answer.h"

namespace {

using bedflow::Reason;

constexpr int wrong_question = 2;

struct Arguments {
  std::string file, query, folder;
  std::uint64_t memory_mib = 4096;
  unsigned seconds = 60;
};

void limit(int resource, std::uint64_t most) {
  const rlimit bounds{most, most};
  ::setrlimit(static_cast<__rlimit_resource_t>(resource), &bounds);
}

// Before a byte of the file is read.
void confine(const Arguments& arguments) {
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_AS, arguments.memory_mib << 20);
  limit(RLIMIT_CPU, arguments.seconds);
  limit(RLIMIT_NOFILE, 64);
  if (arguments.folder.empty()) limit(RLIMIT_FSIZE, 0);
  ::alarm(arguments.seconds);  // ends this process, whatever it waits for
}

void write_out(const void* bytes, std::size_t size) {
  if (std::fwrite(bytes, 1, size, stdout) != size) throw std::runtime_error("the answer cannot be written");
}

// Length (4 bytes, little-endian) and message.
void write_framed(const std::string& message) {
  const auto length = static_cast<std::uint32_t>(message.size());
  std::array<char, 4> bytes{};
  std::memcpy(bytes.data(), &length, 4);
  write_out(bytes.data(), 4);
  write_out(message.data(), message.size());
}

void verify(const std::string& file) {
  for (const std::string& fault : bedflow::verify_checkpoint(file)) write_out((fault + "\n").data(), fault.size() + 1);
}

void describe(const std::string& file) {
  const std::string report = bedflow::describe_checkpoint(file);
  write_out(report.data(), report.size());
}

CLI::App* add_question(CLI::App& app, Arguments& arguments, const char* name, const char* meaning) {
  auto* question = app.add_subcommand(name, meaning);
  question->add_option("file", arguments.file, "the checkpoint")->required()->check(CLI::ExistingFile);
  return question;
}

int tell(const std::string& what, int code) {
  std::fflush(stdout);
  std::fprintf(stderr, "%s\n", what.c_str());
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("bedflow-reader answers one question about one checkpoint file.");
  app.set_version_flag("--version", BEDFLOW_VERSION);
  app.require_subcommand(1);
  app.add_option("--memory-mib", arguments.memory_mib, "most memory, MiB")->check(CLI::Range(64, 1 << 30))->capture_default_str();
  app.add_option("--seconds", arguments.seconds, "longest time, s")->check(CLI::Range(1, 86'400))->capture_default_str();
  add_question(app, arguments, "describe", "what it holds (CheckpointReport, binary)");
  auto* verifying = add_question(app, arguments, "verify", "what is wrong with it, a line each; nothing if it is good");
  auto* asking =
      add_question(app, arguments, "field", "a question about its fields (FieldAnswer, binary, each after its length)");
  asking->add_option("query", arguments.query, "FieldQuery, text format")->required();
  auto* importing = add_question(app, arguments, "import", "make it, and the case it carries, those of a new job folder");
  importing->add_option("folder", arguments.folder, "the folder")->required()->check(CLI::ExistingDirectory);
  CLI11_PARSE(app, argc, argv);
  confine(arguments);
  try {
    if (asking->parsed())
      bedflow::answer_field(arguments.file, arguments.query, write_framed);
    else if (importing->parsed())
      bedflow::import_checkpoint(arguments.file, arguments.folder);
    else if (verifying->parsed())
      verify(arguments.file);
    if (!asking->parsed() && !verifying->parsed()) describe(arguments.file);
    return std::fflush(stdout) == 0 ? 0 : tell("the answer cannot be written", static_cast<int>(Reason::internal));
  } catch (const bedflow::FieldRefusal& refusal) {
    return tell(refusal.what(), wrong_question);
  } catch (const bedflow::Stop& stop) {
    // HDF5 opens nothing but what is asked for: where it fails, the file is not what its seal says.
    const bool by_hdf5 = stop.reason == Reason::internal && std::string_view(stop.what()).starts_with("HDF5: ");
    if (by_hdf5) return tell(stop.what(), static_cast<int>(Reason::checkpoint_corrupt));
    return tell(stop.what(), static_cast<int>(stop.reason));
  } catch (const std::bad_alloc&) {
    return tell("more than " + std::to_string(arguments.memory_mib) + " MiB of memory are needed",
                static_cast<int>(Reason::out_of_memory));
  } catch (const std::exception& error) {
    return tell(error.what(), static_cast<int>(Reason::internal));
  }
}
