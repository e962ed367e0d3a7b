// Replays statistics.log, record by record, into the series and bins that are valid, then answers queries from them.
// Interval of the mean of N bin means: t(0.975, N−1) s/√N, s their standard deviation (N − 1 in its denominator).
#include "statistics_file.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace bedflow {
namespace {

// Values of one place in every closed bin, by `field` (mean or deviation); NaN where the bin has none.
template <typename Bins, typename Field>
v1::Estimate estimate_at(const Bins& bins, int place, Field field) {
  std::vector<double> values;
  for (const auto& [bin, closed] : bins) {
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

// The bytes of the sample, if the record is one: tag and length are a byte each.
std::string_view sample_in(std::string_view payload) {
  constexpr int length_delimited = 2;
  constexpr char tag = v1::StatisticsRecord::kSampleFieldNumber << 3 | length_delimited;
  const bool is_sample = payload.size() > 2 && payload.size() < 128 && payload[0] == tag &&
                         static_cast<std::size_t>(payload[1]) == payload.size() - 2;
  return is_sample ? payload.substr(2) : std::string_view();
}

// One value of a varint; false at the end of the bytes.
bool take_varint(std::string_view& bytes, std::uint64_t& value) {
  value = 0;
  for (int shift = 0; shift < 64 && !bytes.empty(); shift += 7) {
    const auto byte = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
    if (byte < 0x80) return true;
  }
  return false;
}

bool take_tag(std::string_view& bytes, char tag) {
  if (bytes.empty() || bytes.front() != tag) return false;
  bytes.remove_prefix(1);
  return true;
}

bool take_double(std::string_view& bytes, double& value) {
  if (bytes.size() < sizeof value) return false;
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
  return true;
}

struct PlainSample {
  std::uint64_t monitor = 0, step = 0;
  double time = 0, value = 0;
};

// A sample with its four fields in their order, as engines write it; nothing for any other: protobuf reads that. A million
// samples are read in half the time.
std::optional<PlainSample> plain_sample(std::string_view bytes) {
  constexpr char varint = 0, fixed64 = 1;
  constexpr auto tag = [](int field, char type) { return static_cast<char>(field << 3 | type); };
  PlainSample sample;
  const bool is_plain = take_tag(bytes, tag(v1::Sample::kMonitorFieldNumber, varint)) && take_varint(bytes, sample.monitor) &&
                        take_tag(bytes, tag(v1::Sample::kStepFieldNumber, varint)) && take_varint(bytes, sample.step) &&
                        take_tag(bytes, tag(v1::Sample::kTimeFieldNumber, fixed64)) && take_double(bytes, sample.time) &&
                        take_tag(bytes, tag(v1::Sample::kValueFieldNumber, fixed64)) && take_double(bytes, sample.value) &&
                        bytes.empty();
  return is_plain ? std::optional(sample) : std::nullopt;
}

}  // namespace

void StatisticsLog::update() {
  v1::StatisticsRecord record;
  const bool whole = reader_.read([&](const LogRecord& framed) {
    const auto sample = plain_sample(sample_in(framed.payload));
    if (sample)
      take(sample->monitor, {sample->step, sample->time, sample->value});
    else if (record.ParseFromString(framed.payload))
      take(record);
  });
  if (!whole) {
    throw std::system_error(
        EBADMSG, std::generic_category(),
        "a record in the middle (byte " + std::to_string(reader_.offset()) + ") is damaged in " + path_.string());
  }
}

void StatisticsLog::take(std::uint64_t monitor, const Sample& sample) {
  if (monitor < monitors_.size()) monitors_[monitor].samples.push_back(sample);
}

void StatisticsLog::take(const v1::StatisticsRecord& record) {
  switch (record.what_case()) {
    case v1::StatisticsRecord::kSchema:
      schema_ = record.schema();
      monitors_.resize(static_cast<std::size_t>(schema_.monitors_size()));
      reserve();
      break;
    case v1::StatisticsRecord::kSample:
      take(record.sample().monitor(), {record.sample().step(), record.sample().time(), record.sample().value()});
      break;
    case v1::StatisticsRecord::kBin:
      if (record.bin().monitor() < monitors_.size()) monitors_[record.bin().monitor()].closed[record.bin().bin()] = record.bin();
      break;
    case v1::StatisticsRecord::kResumed:
      forget_after(record.resumed().step());
      break;
    case v1::StatisticsRecord::WHAT_NOT_SET:
      break;
  }
}

// Room for what is in the log already, if the series have it in even parts: growing by copies would cost as much as reading does.
void StatisticsLog::reserve() {
  constexpr std::size_t sample_bytes = 47;  // with its frame, at a million steps
  std::error_code none;
  const std::size_t bytes = std::filesystem::file_size(path_, none);
  if (none || monitors_.empty()) return;
  for (Monitor& monitor : monitors_) monitor.samples.reserve(bytes / sample_bytes / monitors_.size());
}

void StatisticsLog::forget_after(std::uint64_t step) {
  for (Monitor& monitor : monitors_) {
    std::erase_if(monitor.samples, [&](const Sample& sample) { return sample.step > step; });
    std::erase_if(monitor.closed, [&](const auto& bin) { return bin.second.step() > step; });
  }
}

std::size_t StatisticsLog::bytes() const {
  std::size_t bytes = schema_.SpaceUsedLong();
  for (const Monitor& monitor : monitors_) {
    bytes += monitor.samples.capacity() * sizeof(Sample);
    for (const auto& [bin, closed] : monitor.closed) bytes += closed.SpaceUsedLong();
  }
  return bytes;
}

// Steps and times ascend.
std::span<const StatisticsLog::Sample> StatisticsLog::within(const std::vector<Sample>& samples, const StatisticsQuery& query) {
  const auto is_before = [&](const Sample& sample) {
    return (query.from_time && sample.time < *query.from_time) || (query.from_step && sample.step < *query.from_step);
  };
  const auto is_within = [&](const Sample& sample) {
    return (!query.to_time || sample.time <= *query.to_time) && (!query.to_step || sample.step <= *query.to_step);
  };
  const auto begin = std::partition_point(samples.begin(), samples.end(), is_before);
  return {begin, std::partition_point(begin, samples.end(), is_within)};
}

void StatisticsLog::put(std::span<const Sample> samples, v1::Series& series) {
  const auto count = static_cast<int>(samples.size());
  series.mutable_step()->Reserve(count);
  series.mutable_time()->Reserve(count);
  series.mutable_value()->Reserve(count);
  for (const Sample& sample : samples) {
    series.add_step(sample.step);
    series.add_time(sample.time);
    series.add_value(sample.value);
  }
}

// Groups of neighbours, as even as can be; so no peak is lost in a plot and every mean stays what it was.
void StatisticsLog::put_thinned(std::span<const Sample> samples, std::size_t groups, v1::Series& series) {
  for (std::size_t group = 0; group < groups; ++group) {
    const std::size_t begin = group * samples.size() / groups, end = (group + 1) * samples.size() / groups;
    double time = 0, sum = 0, low = samples[begin].value, high = low;
    for (const Sample& sample : samples.subspan(begin, end - begin)) {
      time += sample.time - samples[begin].time;
      sum += sample.value;
      low = std::min(low, sample.value);
      high = std::max(high, sample.value);
    }
    const auto count = static_cast<double>(end - begin);
    series.add_step(samples[end - 1].step);
    series.add_time(samples[begin].time + time / count);
    series.add_value(sum / count);
    series.add_minimum(low);
    series.add_maximum(high);
    series.add_samples(static_cast<std::uint32_t>(end - begin));
  }
}

v1::Series StatisticsLog::series_of(std::size_t monitor, const StatisticsQuery& query) const {
  const v1::MonitorSchema& schema = schema_.monitors(static_cast<int>(monitor));
  v1::Series series;
  series.set_name(schema.name());
  series.set_unit(schema.unit());
  series.set_meaning(schema.meaning());
  const std::span<const Sample> samples = within(monitors_[monitor].samples, query);
  if (query.most > 0 && samples.size() > query.most)
    put_thinned(samples, query.most, series);
  else
    put(samples, series);
  if (schema.averaging_bin() > 0) {
    *series.mutable_average() = estimate_at(monitors_[monitor].closed, 0, mean_of);
    *series.mutable_deviation() = estimate_at(monitors_[monitor].closed, 0, deviation_of);
  }
  return series;
}

v1::Profile StatisticsLog::profile_of(std::size_t monitor) const {
  const v1::MonitorSchema& schema = schema_.monitors(static_cast<int>(monitor));
  v1::Profile profile;
  profile.set_name(schema.name());
  profile.set_unit(schema.unit());
  profile.set_meaning(schema.meaning());
  *profile.mutable_place() = schema.places();
  for (int place = 0; place < schema.places_size(); ++place) {
    *profile.add_average() = estimate_at(monitors_[monitor].closed, place, mean_of);
    *profile.add_deviation() = estimate_at(monitors_[monitor].closed, place, deviation_of);
  }
  return profile;
}

void StatisticsLog::note_newest(std::size_t monitor, v1::Statistics& statistics) const {
  const auto note = [&](std::uint64_t step, double time) {
    if (statistics.has_step() && step <= statistics.step()) return;
    statistics.set_step(step);
    statistics.set_time(time);
  };
  const auto& [samples, closed] = monitors_[monitor];
  if (!samples.empty()) note(samples.back().step, samples.back().time);
  if (!closed.empty()) {
    const v1::MonitorSchema& schema = schema_.monitors(static_cast<int>(monitor));
    const v1::BinClosed& last = closed.rbegin()->second;
    note(last.step(), schema.averaging_start() + (last.bin() + 1) * schema.averaging_bin());
  }
}

v1::Statistics StatisticsLog::answer(const StatisticsQuery& query) const {
  check_names(schema_, query.names);
  v1::Statistics statistics;
  for (std::size_t i = 0; i < monitors_.size(); ++i) {
    const v1::MonitorSchema& schema = schema_.monitors(static_cast<int>(i));
    note_newest(i, statistics);
    if (!query.names.empty() && std::find(query.names.begin(), query.names.end(), schema.name()) == query.names.end()) continue;
    if (schema.is_profile()) {
      *statistics.add_profiles() = profile_of(i);
    } else {
      *statistics.add_series() = series_of(i, query);
    }
  }
  return statistics;
}

std::vector<v1::SeriesInfo> StatisticsLog::series() const {
  std::vector<v1::SeriesInfo> list;
  for (std::size_t i = 0; i < monitors_.size(); ++i) {
    v1::SeriesInfo& info = list.emplace_back();
    *info.mutable_monitor() = schema_.monitors(static_cast<int>(i));
    const auto& [samples, closed] = monitors_[i];
    info.set_samples(samples.size());
    info.set_bins(static_cast<std::uint32_t>(closed.size()));
    if (samples.empty()) continue;
    info.set_first_step(samples.front().step);
    info.set_last_step(samples.back().step);
    info.set_first_time(samples.front().time);
    info.set_last_time(samples.back().time);
  }
  return list;
}

v1::Statistics read_statistics(const std::filesystem::path& log, const StatisticsQuery& query) {
  StatisticsLog statistics(log);
  statistics.update();
  return statistics.answer(query);
}

void check_names(const v1::Schema& schema, std::span<const std::string> names) {
  if (schema.monitors().empty()) return;  // nothing is known yet: no answer, and no fault
  for (const std::string& name : names) {
    const auto has_name = [&](const v1::MonitorSchema& monitor) { return monitor.name() == name; };
    if (std::any_of(schema.monitors().begin(), schema.monitors().end(), has_name)) continue;
    std::string known;
    for (const v1::MonitorSchema& monitor : schema.monitors()) known += (known.empty() ? "" : ", ") + monitor.name();
    throw std::out_of_range("no monitor is called '" + name + "'; there are: " + known);
  }
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
