// The command line: each file of verbs adds its own to the program.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "contexts.h"
#include "failure.h"
#include "table.h"

namespace bedflow::client {

struct Program {
  std::vector<std::string> words;  // as they were typed
  ServerChoice server;             // what --server and --context say
  std::function<Exit()> verb;      // what was asked for
};

void add_case_verbs(CLI::App& app, Program& program);        // init, validate, reference, explain
void add_run_verb(CLI::App& app, Program& program);          // run
void add_job_verbs(CLI::App& app, Program& program);         // submit, list, get, cancel, suspend, resume, delete
void add_watch_verbs(CLI::App& app, Program& program);       // watch, wait, logs
void add_result_verbs(CLI::App& app, Program& program);      // stats, plot, render
void add_field_verbs(CLI::App& app, Program& program);       // field
void add_checkpoint_verbs(CLI::App& app, Program& program);  // checkpoint
void add_reproduce_verb(CLI::App& app, Program& program);    // reproduce
void add_study_verbs(CLI::App& app, Program& program);       // study
void add_server_verbs(CLI::App& app, Program& program);      // server
void add_token_verbs(CLI::App* server, Program& program);    // server token
void add_context_verbs(CLI::App& app, Program& program);     // context
void add_top_verb(CLI::App& app, Program& program);          // top
void add_completion_verbs(CLI::App& app, Program& program);  // completion

// The verb's function is called once the whole line has been parsed.
template <class Options>
void on_call(CLI::App* verb, Program& program, std::shared_ptr<Options> options,
             Exit (*function)(const Program&, const Options&)) {
  verb->callback(
      [&program, options, function] { program.verb = [&program, options, function] { return function(program, *options); }; });
}

void add_format(CLI::App* verb, Format& format);

}  // namespace bedflow::client
