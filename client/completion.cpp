#include "completion.h"

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <sstream>

#include "cases/ready_cases.h"
#include "connection.h"
#include "reproduction.h"
#include "study_report.h"
#include "terminal.h"
#include "vary.h"

namespace bedflow::client {

namespace {

using Candidates = std::vector<Completion::Candidate>;

constexpr double patience = 0.1;  // s; for all that is asked of a server

// A line as far as it is written: the verb it has come to, its words, and the option that waits for its value.
struct Place {
  CLI::App* verb;
  std::vector<std::string> words;  // behind the verb, without options
  const CLI::Option* option = nullptr;
  std::string current;  // the word at the cursor
  ServerChoice server;
};

CLI::App* subcommand(const CLI::App& app, const std::string& name) {
  for (CLI::App* sub : const_cast<CLI::App&>(app).get_subcommands({})) {
    if (sub->get_name() == name) return sub;
  }
  return nullptr;
}

const CLI::Option* option_of(const CLI::App* app, const std::string& name) {
  for (; app; app = app->get_parent()) {
    if (const auto* option = app->get_option_no_throw(name)) return option;
  }
  return nullptr;
}

// Which server the line itself names.
void choose(ServerChoice& server, const CLI::Option& option, const std::string& value) {
  if (option.get_single_name() == "server") server = {value, ""};
  if (option.get_single_name() == "context") server = {"", value};
}

Place place_of(CLI::App& app, const std::string& line, const ServerChoice& server) {
  std::istringstream stream(line);
  std::vector<std::string> all;
  for (std::string word; stream >> word;) all.push_back(word);
  Place place{&app, {}, nullptr, "", server};
  const bool at_new_word = line.empty() || std::isspace(static_cast<unsigned char>(line.back()));
  if (!at_new_word && all.size() > 1) {
    place.current = all.back();
    all.pop_back();
  }
  for (std::size_t i = 1; i < all.size(); ++i) {
    const auto& word = all[i];
    if (place.option) {
      choose(place.server, *place.option, word);
      place.option = nullptr;
    } else if (word.starts_with('-')) {
      const auto equals = word.find('=');
      const auto* option = option_of(place.verb, word.substr(0, equals));
      if (option && equals == word.npos && option->get_items_expected_max() > 0) place.option = option;
      if (option && equals != word.npos) choose(place.server, *option, word.substr(equals + 1));
    } else if (auto* verb = subcommand(*place.verb, word)) {
      place.verb = verb;
    } else {
      place.words.push_back(word);
    }
  }
  return place;
}

template <class Names>
Candidates named(const Names& names) {
  Candidates all;
  for (const auto& one : names) all.push_back({std::string(one.name), std::string(one.description)});
  return all;
}

// --------------------------------------------------------------------------------------------- what the server knows

class Server {
 public:
  explicit Server(const ServerChoice& choice) : connection_(choice) { connection_.set_quiet(); }

  Candidates jobs() const {
    v1::ListJobsRequest request;
    request.set_page_size(200);
    Candidates all;
    const auto answer = ask(&Stub::ListJobs, request);
    for (const auto& job : answer.jobs()) all.push_back({job.id(), job.case_name() + ", " + state_name(job.state())});
    return all;
  }
  Candidates steps(const std::string& job, const std::string& before = "") const {
    v1::ListCheckpointsRequest request;
    request.set_id(job);
    Candidates all;
    const auto answer = ask(&Stub::ListCheckpoints, request);
    for (const auto& one : answer.checkpoints())
      all.push_back({before + std::to_string(one.step()), "t = " + number_text(one.time()) + " s"});
    return all;
  }
  // Of JOB@STEP: the jobs, and behind the @ their checkpoints.
  Candidates checkpoints(const std::string& current) const {
    const auto at = current.find('@');
    return at == current.npos ? jobs() : steps(current.substr(0, at), current.substr(0, at + 1));
  }
  Candidates series(const std::string& job) const {
    v1::ListSeriesRequest request;
    request.set_id(job);
    Candidates all;
    const auto answer = ask(&Stub::ListSeries, request);
    for (const auto& one : answer.series()) all.push_back({one.monitor().name(), one.monitor().meaning()});
    return all;
  }
  Candidates studies() const {
    Candidates all;
    const auto answer = ask(&Stub::ListStudies, v1::ListStudiesRequest());
    for (const auto& one : answer.studies()) all.push_back({one.id(), one.spec().name() + ", " + study_state_name(one.state())});
    return all;
  }
  Candidates quantities(const std::string& job) const {
    v1::GetCheckpointRequest request;
    request.mutable_name()->set_job(job);
    Candidates all;
    const auto answer = ask(&Stub::GetCheckpoint, request);
    for (const auto& one : answer.content().quantities()) all.push_back({one.name(), one.meaning()});
    return all;
  }

 private:
  template <class Request, class Response>
  Response ask(Connection::Method<Request, Response> method, const Request& request) const {
    try {
      return connection_.call(method, request, patience);
    } catch (const Failure&) {
      return {};
    }
  }
  Connection connection_;
};

// ------------------------------------------------------------------------------------------------ values of options

Candidates states() {
  Candidates all;
  for (int state = v1::PENDING; state <= v1::FAILED; ++state) all.push_back({state_name(static_cast<v1::JobState>(state)), ""});
  return all;
}

bool takes_a_file(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::string& name = option.get_single_name();
  return type.find("FILE") != type.npos || type.find("FOLDER") != type.npos || name == "case" || name == "diff" ||
         name == "data" || name == "out" || option.get_description().find("folder") != std::string::npos;
}

Candidates contexts() {
  Candidates all;
  const auto known = read_contexts();
  for (const auto& one : known.contexts()) all.push_back({one.name(), one.server()});
  return all;
}

Candidates axes() {
  Candidates all;
  for (const auto& knob : knobs()) all.push_back({knob.name, knob.meaning});
  return all;
}

Candidates beds() {
  Candidates all;
  for (const auto& name : published_conditions()) all.push_back({name, ""});
  return all;
}

// By the option's name: the same name means the same thing in every verb.
Candidates values_of(const CLI::Option& option, const Place& place, const std::string& current) {
  const std::string& name = option.get_single_name();
  const auto job = [&] { return place.words.empty() ? std::string() : place.words.front(); };
  if (name == "output") return {{"table", "for people"}, {"json", ""}, {"jsonl", "an object a line"}, {"csv", ""}};
  if (name == "axis") return {{"x", ""}, {"y", ""}, {"z", ""}};
  if (name == "state" || name == "for") return states();
  if (name == "case" || name == "diff" || (name == "name" && place.verb->get_name() == "init")) return named(ready_cases());
  if (name == "preset" || name == "presets") return named(ready_presets());
  if (name == "bed") return beds();
  if (name == "vary") return axes();
  if (name == "shell") return {{"bash", ""}, {"zsh", ""}, {"fish", ""}};
  if (name == "context" || (name == "name" && place.verb->get_parent()->get_name() == "context")) return contexts();
  const Server server(place.server);
  if (name == "study") return server.studies();
  if (name == "job" || name == "start-from")
    return option.get_type_name().find("@STEP") == std::string::npos ? server.jobs() : server.checkpoints(current);
  if (job().empty()) return {};
  if (name == "name") return server.series(job());
  if (name == "quantity") return server.quantities(job());
  if (name == "step") return server.steps(job());
  return {};
}

void add_values(const CLI::Option& option, const Place& place, const std::string& current, Completion& completion) {
  completion.files = takes_a_file(option);
  try {
    completion.candidates = values_of(option, place, current);
  } catch (const Failure&) {  // a context that is not there, say: the command itself will tell
  }
}

void add_options(const Place& place, Completion& completion) {
  for (const auto* app = place.verb; app; app = app->get_parent()) {
    for (const auto* option : app->get_options()) {
      for (const auto& name : option->get_lnames()) completion.candidates.push_back({"--" + name, option->get_description()});
    }
  }
}

}  // namespace

Completion complete(CLI::App& app, const std::string& line, const ServerChoice& otherwise) {
  const Place place = place_of(app, line, otherwise);
  Completion completion;
  const auto equals = place.current.find('=');
  if (place.option) {
    add_values(*place.option, place, place.current, completion);
  } else if (place.current.starts_with("--") && equals != std::string::npos) {
    const std::string before = place.current.substr(0, equals + 1);
    if (const auto* option = option_of(place.verb, place.current.substr(0, equals)))
      add_values(*option, place, place.current.substr(equals + 1), completion);
    for (auto& one : completion.candidates) one.text.insert(0, before);
  } else if (place.current.starts_with('-')) {
    add_options(place, completion);
  } else {
    const auto positionals = std::as_const(*place.verb).get_options([](const CLI::Option* one) { return one->get_positional(); });
    const auto index = std::min(place.words.size(), positionals.empty() ? 0 : positionals.size() - 1);
    const bool is_over = positionals.empty() || (index < place.words.size() && positionals.back()->get_expected_max() <= 1);
    if (!is_over) add_values(*positionals[index], place, place.current, completion);
    for (const auto* verb : place.verb->get_subcommands({})) {
      if (place.words.empty() && !verb->get_group().empty())
        completion.candidates.push_back({verb->get_name(), verb->get_description()});
    }
  }
  std::erase_if(completion.candidates, [&](const auto& one) { return !one.text.starts_with(place.current); });
  return completion;
}

}  // namespace bedflow::client
