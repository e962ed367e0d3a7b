// Replays statistics.log, record by record, into the series and bins that are valid, then answers a query from them.
// Interval of the mean of N bin means: t(0.975, N−1) s/√N, s their standard deviation (N − 1 in its denominator).
#include "statistics_file.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cerrno>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <system_error>

#include "record_log.h"

namespace bedflow {
namespace {

struct StoredSample {
  std::uint64_t step = 0;
  double time = 0;
  double value = 0;
};

struct Monitor {
  std::vector<StoredSample> samples;              // steps ascend
  std::map<std::uint32_t, v1::BinClosed> closed;  // by bin
};

class Replay {
 public:
  void take(const v1::StatisticsRecord& record) {
    switch (record.what_case()) {
      case v1::StatisticsRecord::kSchema:
        schema_ = record.schema();
        monitors_.resize(schema_.monitors_size());
        break;
      case v1::StatisticsRecord::kSample: {
        const v1::Sample& sample = record.sample();
        if (sample.monitor() < monitors_.size()) {
          monitors_[sample.monitor()].samples.push_back({sample.step(), sample.time(), sample.value()});
        }
        break;
      }
      case v1::StatisticsRecord::kBin:
        if (record.bin().monitor() < monitors_.size())
          monitors_[record.bin().monitor()].closed[record.bin().bin()] = record.bin();
        break;
      case v1::StatisticsRecord::kResumed:
        forget_after(record.resumed().step());
        break;
      case v1::StatisticsRecord::WHAT_NOT_SET:
        break;
    }
  }

  const v1::Schema& schema() const { return schema_; }
  const Monitor& monitor(int i) const { return monitors_[i]; }

 private:
  void forget_after(std::uint64_t step) {
    for (Monitor& monitor : monitors_) {
      std::erase_if(monitor.samples, [&](const StoredSample& sample) { return sample.step > step; });
      std::erase_if(monitor.closed, [&](const auto& bin) { return bin.second.step() > step; });
    }
  }

  v1::Schema schema_;
  std::vector<Monitor> monitors_;
};

std::vector<StoredSample> within(const std::vector<StoredSample>& samples, const StatisticsQuery& query) {
  std::vector<StoredSample> kept;
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(kept), [&](const StoredSample& sample) {
    return (!query.from_time || sample.time >= *query.from_time) && (!query.to_time || sample.time <= *query.to_time);
  });
  return kept;
}

// Of each of most/2 groups of neighbours the least and the greatest, in order of time; so no peak is lost in a plot.
std::vector<StoredSample> thinned(const std::vector<StoredSample>& samples, std::size_t most) {
  if (most == 0 || samples.size() <= most) return samples;
  const std::size_t groups = std::max<std::size_t>(most / 2, 1);
  std::vector<StoredSample> kept;
  for (std::size_t group = 0; group < groups; ++group) {
    const auto begin = samples.begin() + static_cast<std::ptrdiff_t>(group * samples.size() / groups);
    const auto end = samples.begin() + static_cast<std::ptrdiff_t>((group + 1) * samples.size() / groups);
    auto [low, high] =
        std::minmax_element(begin, end, [](const StoredSample& a, const StoredSample& b) { return a.value < b.value; });
    if (high < low) std::swap(low, high);
    kept.push_back(*low);
    if (high != low) kept.push_back(*high);
  }
  return kept;
}

// Values of one place in every closed bin, by `field` (mean or deviation); NaN where the bin has none.
template <typename Field>
v1::Estimate estimate_at(const Monitor& monitor, int place, Field field) {
  std::vector<double> values;
  for (const auto& [bin, closed] : monitor.closed) {
    const auto& row = field(closed);
    values.push_back(place < row.size() ? row.Get(place) : std::numeric_limits<double>::quiet_NaN());
  }
  return estimate(values);
}

constexpr auto mean_of = [](const v1::BinClosed& bin) -> const auto& {
  return bin.mean();
};
constexpr auto deviation_of = [](const v1::BinClosed& bin) -> const auto& {
  return bin.deviation();
};

v1::Series series_of(const v1::MonitorSchema& schema, const Monitor& monitor, const StatisticsQuery& query) {
  v1::Series series;
  series.set_name(schema.name());
  series.set_unit(schema.unit());
  series.set_meaning(schema.meaning());
  for (const StoredSample& sample : thinned(within(monitor.samples, query), query.most)) {
    series.add_step(sample.step);
    series.add_time(sample.time);
    series.add_value(sample.value);
  }
  if (schema.averaging_bin() > 0) {
    *series.mutable_average() = estimate_at(monitor, 0, mean_of);
    *series.mutable_deviation() = estimate_at(monitor, 0, deviation_of);
  }
  return series;
}

v1::Profile profile_of(const v1::MonitorSchema& schema, const Monitor& monitor) {
  v1::Profile profile;
  profile.set_name(schema.name());
  profile.set_unit(schema.unit());
  profile.set_meaning(schema.meaning());
  *profile.mutable_place() = schema.places();
  for (int place = 0; place < schema.places_size(); ++place) {
    *profile.add_average() = estimate_at(monitor, place, mean_of);
    *profile.add_deviation() = estimate_at(monitor, place, deviation_of);
  }
  return profile;
}

void note_newest(const v1::MonitorSchema& schema, const Monitor& monitor, v1::Statistics& statistics) {
  const auto note = [&](std::uint64_t step, double time) {
    if (statistics.has_step() && step <= statistics.step()) return;
    statistics.set_step(step);
    statistics.set_time(time);
  };
  if (!monitor.samples.empty()) note(monitor.samples.back().step, monitor.samples.back().time);
  if (!monitor.closed.empty()) {
    const v1::BinClosed& last = monitor.closed.rbegin()->second;
    note(last.step(), schema.averaging_start() + (last.bin() + 1) * schema.averaging_bin());
  }
}

void check_names(const v1::Schema& schema, const std::vector<std::string>& names) {
  if (schema.monitors().empty()) return;  // nothing is known yet: no answer, and no fault
  for (const std::string& name : names) {
    const auto has_name = [&](const v1::MonitorSchema& monitor) { return monitor.name() == name; };
    if (std::any_of(schema.monitors().begin(), schema.monitors().end(), has_name)) continue;
    std::string known;
    for (const v1::MonitorSchema& monitor : schema.monitors()) known += (known.empty() ? "" : ", ") + monitor.name();
    throw std::out_of_range("no monitor is called '" + name + "'; there are: " + known);
  }
}

}  // namespace

v1::Statistics read_statistics(const std::filesystem::path& log, const StatisticsQuery& query) {
  Replay replay;
  LogReader reader(log);
  const bool whole = reader.read([&](const LogRecord& framed) {
    v1::StatisticsRecord record;
    if (record.ParseFromString(framed.payload)) replay.take(record);
  });
  if (!whole) {
    throw std::system_error(
        EBADMSG, std::generic_category(),
        "a record in the middle (byte " + std::to_string(reader.offset()) + ") is damaged in " + log.string());
  }
  check_names(replay.schema(), query.names);
  v1::Statistics statistics;
  for (int i = 0; i < replay.schema().monitors_size(); ++i) {
    const v1::MonitorSchema& schema = replay.schema().monitors(i);
    note_newest(schema, replay.monitor(i), statistics);
    if (!query.names.empty() && std::find(query.names.begin(), query.names.end(), schema.name()) == query.names.end()) continue;
    if (schema.is_profile()) {
      *statistics.add_profiles() = profile_of(schema, replay.monitor(i));
    } else {
      *statistics.add_series() = series_of(schema, replay.monitor(i), query);
    }
  }
  return statistics;
}

v1::Estimate estimate(std::span<const double> bin_means) {
  double sum = 0;
  std::uint32_t bins = 0;
  for (const double mean : bin_means) {
    if (std::isnan(mean)) continue;
    sum += mean;
    ++bins;
  }
  v1::Estimate result;
  result.set_bins(bins);
  if (bins == 0) return result;
  const double mean = sum / bins;
  result.set_mean(mean);
  if (bins < 2) return result;
  double squares = 0;
  for (const double value : bin_means) {
    if (!std::isnan(value)) squares += (value - mean) * (value - mean);
  }
  const double deviation = std::sqrt(squares / (bins - 1));
  const double quantile = boost::math::quantile(boost::math::students_t(bins - 1), 0.975);
  result.set_half_width(quantile * deviation / std::sqrt(bins));
  return result;
}

}  // namespace bedflow
