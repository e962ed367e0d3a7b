#include "statistics_follow.h"

#include <chrono>
#include <thread>

#include "terminal.h"

namespace bedflow::client {

namespace {

using Clock = std::chrono::steady_clock;

class Follower {
 public:
  Follower(const FollowPlan& plan, Format format) : plan_(plan), format_(format == Format::json ? Format::jsonl : format) {}

  void take(const v1::StreamStatisticsResponse& response) {
    if (response.has_schema()) schema_ = response.schema();
    Table table({"name", "step", "time_s", "value"});
    for (const auto& record : response.records()) {
      if (record.has_sample()) add(record.sample(), table);
      if (record.has_resumed() && newest_ > record.resumed().step()) {
        print(table);
        say("the job has gone back to step " + std::to_string(record.resumed().step()) + ": samples of later steps come again");
        newest_ = record.resumed().step();
      }
    }
    print(table);
  }

 private:
  void add(const v1::Sample& sample, Table& table) {
    newest_ = std::max(newest_, sample.step());
    const bool early =
        (plan_.from_time && sample.time() < *plan_.from_time) || (plan_.from_step && sample.step() < *plan_.from_step);
    const bool late = (plan_.to_time && sample.time() > *plan_.to_time) || (plan_.to_step && sample.step() > *plan_.to_step);
    if (early || late || static_cast<int>(sample.monitor()) >= schema_.monitors_size()) return;
    table.add({schema_.monitors(static_cast<int>(sample.monitor())).name(), sample.step(), sample.time(), sample.value()});
  }
  // One head for all lines.
  void print(Table& table) {
    if (table.empty()) return;
    std::string text = table.text(format_);
    if (format_ != Format::jsonl && headed_) text.erase(0, text.find('\n') + 1);
    headed_ = true;
    print_data(text);
    table = Table({"name", "step", "time_s", "value"});
  }

  const FollowPlan& plan_;
  const Format format_;
  v1::Schema schema_;
  std::uint64_t newest_ = 0;
  bool headed_ = false;
};

}  // namespace

void follow_statistics(const Connection& connection, const std::string& id, const FollowPlan& plan, Format format) {
  Follower follower(plan, format);
  v1::StreamStatisticsRequest request;
  request.set_id(id);
  for (const auto& name : plan.names) request.add_names(name);
  bool heard = false, away = false;
  for (auto last_heard = Clock::now();;) {
    grpc::ClientContext context;
    const auto reader = connection.stub().StreamStatistics(&context, request);
    v1::StreamStatisticsResponse response;
    while (reader->Read(&response)) {
      if (away) say("connected again");
      heard = true, away = false;
      last_heard = Clock::now();
      follower.take(response);
      request.set_after_record(response.record());
    }
    const auto status = reader->Finish();
    if (status.ok()) return;
    const bool may_come_back = status.error_code() == grpc::UNAVAILABLE || status.error_code() == grpc::CANCELLED;
    if (!may_come_back || !heard || Clock::now() - last_heard > std::chrono::duration<double>(plan.away_seconds))
      throw connection.failure_of(status);
    if (!std::exchange(away, true)) say("the connection to the server is lost; trying for " + duration_text(plan.away_seconds));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
}

}  // namespace bedflow::client
