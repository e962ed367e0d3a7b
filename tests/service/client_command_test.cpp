// Verbs, formats, messages and exit codes of the client.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>

#include "client_fixture.h"
#include "command_line.h"
#include "failure.h"

#include <set>

namespace bedflow::client {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

int code(Exit exit) {
  return static_cast<int>(exit);
}

TEST_F(Client, EachRefusalHasItsExitCode) {
  const std::vector<std::pair<grpc::StatusCode, Exit>> expected = {{grpc::INTERNAL, Exit::other},
                                                                   {grpc::INVALID_ARGUMENT, Exit::usage},
                                                                   {grpc::PERMISSION_DENIED, Exit::not_allowed},
                                                                   {grpc::UNAUTHENTICATED, Exit::not_allowed},
                                                                   {grpc::NOT_FOUND, Exit::not_found},
                                                                   {grpc::FAILED_PRECONDITION, Exit::wrong_state},
                                                                   {grpc::ALREADY_EXISTS, Exit::wrong_state},
                                                                   {grpc::UNAVAILABLE, Exit::unreachable},
                                                                   {grpc::DEADLINE_EXCEEDED, Exit::timed_out},
                                                                   {grpc::RESOURCE_EXHAUSTED, Exit::limit},
                                                                   {grpc::DATA_LOSS, Exit::corrupt}};
  for (const auto& [status, exit] : expected) {
    v1::ErrorDetail detail;
    detail.set_reason("SOME_REASON");
    detail.set_next("bedflow list");
    service_.refusals["j-x"] = refusal(status, "what happened", detail);
    const auto result = bedflow({"get", "j-x"});
    EXPECT_EQ(result.exit_code, code(exit)) << status;
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.error, HasSubstr("what happened [SOME_REASON]\n  next: bedflow list"));
  }
}

TEST_F(Client, AServerThatIsNotThereIsExitSevenWithTheNextCommand) {
  const auto result = run_child({program(), "list", "--server", "unix:" + (folder_ / "none").string()});
  EXPECT_EQ(result.exit_code, code(Exit::unreachable));
  EXPECT_THAT(result.error, HasSubstr("none"));
  EXPECT_THAT(result.error, HasSubstr("next: start one with `bedflowd`"));
}

TEST_F(Client, WrongUsageIsExitTwo) {
  EXPECT_EQ(bedflow({"frobnicate"}).exit_code, code(Exit::usage));
  EXPECT_EQ(bedflow({"get"}).exit_code, code(Exit::usage));
  EXPECT_EQ(bedflow({"list", "-o", "xml"}).exit_code, code(Exit::usage));
  EXPECT_EQ(bedflow({"run"}).exit_code, code(Exit::usage));
  EXPECT_EQ(bedflow({"--help"}).exit_code, code(Exit::ok));
}

TEST_F(Client, FaultsThatTheServerFindsAreListedByPath) {
  v1::ErrorDetail detail;
  detail.set_reason("INVALID_CASE");
  detail.add_faults()->set_path("gas.density");
  detail.mutable_faults(0)->set_text("is -1 kg/m³: allowed is above 0");
  service_.refusals["drop"] = refusal(grpc::INVALID_ARGUMENT, "the case has faults", detail);
  const auto result = bedflow({"submit", "drop"});
  EXPECT_EQ(result.exit_code, code(Exit::usage));
  EXPECT_THAT(result.error, HasSubstr("gas.density: is -1 kg/m³"));
}

TEST_F(Client, SubmitPrintsTheIdAloneOnStdout) {
  const auto result = bedflow({"submit", "drop"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.out, "j-000000000001\n");
}

TEST_F(Client, SubmitRepeatsALostAnswerWithTheSameRequestId) {
  service_.lose_first_answer = true;
  EXPECT_EQ(bedflow({"submit", "drop"}).exit_code, 0);
  const auto ids = service_.request_ids();
  ASSERT_EQ(ids.size(), 2U);
  EXPECT_EQ(ids[0], ids[1]);
  EXPECT_EQ(ids[0].size(), 32U);
}

TEST_F(Client, ListComesAsTableJsonLinesAndCsv) {
  service_.jobs["j-1"] = job_of("j-1", v1::STATE_SUSPENDED);
  service_.jobs["j-2"] = job_of("j-2", v1::FAILED, v1::DIVERGED);
  EXPECT_THAT(bedflow({"list"}).out, HasSubstr("SUSPENDED"));
  EXPECT_THAT(bedflow({"list", "-o", "csv"}).out,
              StartsWith("id,case,state,progress,time_s,eta,ranks,created\nj-1,mueller,SUSPENDED,"));
  const auto lines = bedflow({"list", "-o", "jsonl"}).out;
  v1::Job job;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(lines.substr(0, lines.find('\n')), &job).ok());
  EXPECT_EQ(job.id(), "j-1");
  v1::ListJobsResponse all;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage("{\"jobs\":" + bedflow({"list", "-o", "json"}).out + "}", &all).ok());
  EXPECT_EQ(all.jobs(1).reason(), v1::DIVERGED);
}

// Verbs that print data take -o; what the others print is one text, or nothing.
void find_verbs_without_format(const std::string& name, CLI::App& app, std::vector<std::string>& found, std::size_t& verbs) {
  const auto below = app.get_subcommands({});
  for (auto* verb : below) find_verbs_without_format(name + (name.empty() ? "" : " ") + verb->get_name(), *verb, found, verbs);
  if (!below.empty()) return;
  ++verbs;
  const auto* option = app.get_option_no_throw("--output");
  if (!option || option->get_description() != "table, json, jsonl or csv") found.push_back(name);
}

TEST_F(Client, EveryVerbThatPrintsDataTakesTableJsonLinesAndCsv) {
  Program program;
  const auto app = command_line(program);
  std::vector<std::string> found;
  std::size_t verbs = 0;
  find_verbs_without_format("", *app, found, verbs);
  const std::set<std::string> others = {"completion",  // a script for a shell
                                        "__complete",  // its question
                                        "plot",        // -o names the file
                                        "render",       "checkpoint download",
                                        "reproduce",     // writes a page
                                        "study cancel",  // say on stderr that it is done
                                        "study delete", "server token revoke", "context add", "context use", "context remove"};
  EXPECT_GT(verbs, 30U);
  for (const auto& name : found) EXPECT_TRUE(others.contains(name)) << "bedflow " << name << " has no -o";
  for (const auto& name : others) EXPECT_THAT(found, testing::Contains(name));
}

TEST_F(Client, ValidateListsEveryFaultWithItsPathAndExitsTwo) {
  const auto file = write("bad.txtpb", bedflow({"init", "mueller"}).out + "\ngas { density: -1 viscosity: nan }\n");
  const auto result = bedflow({"validate", file});
  EXPECT_EQ(result.exit_code, code(Exit::usage));
  const auto both = bedflow({"validate", "mueller", "--set", "gas.density=-1", "--set", "particles.diameter=0"});
  EXPECT_EQ(both.exit_code, code(Exit::usage));
  EXPECT_THAT(both.error, HasSubstr("gas.density: "));
  EXPECT_THAT(both.error, HasSubstr("particles.diameter: "));
  const auto json = bedflow({"validate", "mueller", "--set", "gas.density=-1", "-o", "json"});
  EXPECT_EQ(json.exit_code, code(Exit::usage));
  EXPECT_THAT(json.out, HasSubstr("\"path\": \"gas.density\""));
}

TEST_F(Client, AReadyCaseThatIsPrintedIsValid) {
  const auto text = bedflow({"init", "mueller"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_EQ(bedflow({"validate", "-"}, text.out).exit_code, 0);
}

TEST_F(Client, SetReachesListsAndChoosesArms) {
  const auto result =
      bedflow({"init", "mueller", "--set", "monitors[0].interval=0.25", "--set", "coupling.ergun", "--set", "name=other"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_THAT(result.out, HasSubstr("interval: 0.25"));
  EXPECT_THAT(result.out, HasSubstr("ergun {"));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("gidaspow_blended")));
  EXPECT_THAT(result.out, HasSubstr("name: \"other\""));
  const auto wrong = bedflow({"init", "mueller", "--set", "particles.diametr=1"});
  EXPECT_EQ(wrong.exit_code, code(Exit::usage));
  EXPECT_THAT(wrong.error, HasSubstr("there are diameter, density"));
}

TEST_F(Client, ReferenceNamesUnitsAndBounds) {
  const auto result = bedflow({"reference"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("viscosity"));
  EXPECT_THAT(result.out, HasSubstr("Pa·s"));
}

}  // namespace
}  // namespace bedflow::client
