#include "statistics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "refusal.h"

namespace bedflow::server {
namespace {

constexpr std::size_t most_bytes = 256 << 20;  // of all logs that are kept

StatisticsQuery query_of(const v1::QueryStatisticsRequest& request) {
  if (std::isnan(request.from_time()) || std::isnan(request.to_time()))
    throw Refusal(Refused::bad_request, "from_time and to_time must be numbers");
  StatisticsQuery query;
  query.names = {request.names().begin(), request.names().end()};
  query.most = request.most();
  if (request.has_from_time()) query.from_time = request.from_time();
  if (request.has_to_time()) query.to_time = request.to_time();
  if (request.has_from_step()) query.from_step = request.from_step();
  if (request.has_to_step()) query.to_step = request.to_step();
  return query;
}

}  // namespace

std::shared_ptr<StatisticsLogs::Kept> StatisticsLogs::kept(const JobFolder& folder, const std::string& id) {
  const std::lock_guard guard(mutex_);
  auto& entry = logs_[id];
  if (entry) {
    asked_.splice(asked_.begin(), asked_, entry->place);
  } else {
    entry = std::make_shared<Kept>(folder.statistics());
    entry->place = asked_.insert(asked_.begin(), id);
  }
  return entry;
}

void StatisticsLogs::drop_oldest() {
  const std::lock_guard guard(mutex_);
  std::size_t bytes = 0;
  for (const auto& [id, log] : logs_) bytes += log->bytes;
  while (bytes > most_bytes && !asked_.empty()) {
    const auto oldest = logs_.find(asked_.back());
    bytes -= oldest->second->bytes;
    logs_.erase(oldest);
    asked_.pop_back();
  }
}

template <class Ask>
auto StatisticsLogs::ask(const JobFolder& folder, const std::string& id, Ask ask) {
  const auto log = kept(folder, id);
  std::unique_lock guard(log->mutex);
  try {
    log->log.update();
    auto answer = ask(log->log);
    const std::size_t bytes = log->log.bytes();
    guard.unlock();
    {
      const std::lock_guard all(mutex_);
      log->bytes = bytes;
    }
    drop_oldest();
    return answer;
  } catch (const std::out_of_range& unknown) {
    throw Refusal(Refused::series_not_found, unknown.what(), "bedflow stats " + id);
  } catch (const std::system_error& damaged) {
    throw Refusal(Refused::log_damaged, damaged.what(), "bedflow logs " + id);
  }
}

v1::Statistics StatisticsLogs::query(const JobFolder& folder, const v1::QueryStatisticsRequest& request) {
  const StatisticsQuery query = query_of(request);
  return ask(folder, request.id(), [&](const StatisticsLog& log) { return log.answer(query); });
}

v1::ListSeriesResponse StatisticsLogs::list(const JobFolder& folder, const std::string& id) {
  return ask(folder, id, [](const StatisticsLog& log) {
    v1::ListSeriesResponse response;
    for (auto& series : log.series()) *response.add_series() = std::move(series);
    return response;
  });
}

// --------------------------------------------------------------------------------------------------------- follower

StatisticsFollower::StatisticsFollower(const JobFolder& folder, const v1::StreamStatisticsRequest& request)
    : request_(request), reader_(folder.statistics()), record_(request.after_record()) {}

bool StatisticsFollower::is_wanted(const v1::StatisticsRecord& record) const {
  if (record.has_sample()) return record.sample().monitor() < wanted_.size() && wanted_[record.sample().monitor()];
  if (record.has_bin()) return record.bin().monitor() < wanted_.size() && wanted_[record.bin().monitor()];
  return record.has_resumed();
}

void StatisticsFollower::take(const LogRecord& framed, v1::StreamStatisticsResponse& answer) {
  const bool seen = framed.sequence <= request_.after_record();
  v1::StatisticsRecord record;
  if (!record.ParseFromString(framed.payload)) return;
  if (record.has_schema()) {
    const std::vector<std::string> names(request_.names().begin(), request_.names().end());
    check_names(record.schema(), names);
    wanted_.clear();
    for (const auto& monitor : record.schema().monitors())
      wanted_.push_back(names.empty() || std::find(names.begin(), names.end(), monitor.name()) != names.end());
    *answer.mutable_schema() = record.schema();  // one that resumes needs it too
  }
  if (seen) return;
  record_ = framed.sequence;
  if (is_wanted(record)) *answer.add_records() = std::move(record);
}

bool StatisticsFollower::next(v1::StreamStatisticsResponse& answer) {
  constexpr std::size_t most_records = 4096;
  const std::uint64_t before = record_;
  bool more = true;
  while (more && answer.records_size() == 0) {
    const std::uint64_t start = reader_.offset();
    bool sound = true;
    try {
      sound = reader_.read_up_to(most_records, [&](const LogRecord& framed) { take(framed, answer); });
    } catch (const std::out_of_range& unknown) {
      throw Refusal(Refused::series_not_found, unknown.what(), "bedflow stats " + request_.id());
    }
    if (!sound && answer.records_size() == 0) {
      throw Refusal(Refused::log_damaged, "the statistics are damaged behind record " + std::to_string(record_),
                    "bedflow logs " + request_.id());
    }
    more = reader_.offset() != start;
  }
  answer.set_record(record_);
  return record_ != before || answer.has_schema();
}

}  // namespace bedflow::server
