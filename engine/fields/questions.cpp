#include "fields/questions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

namespace bedflow {

namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t most_values = 100'000'000;  // of one answer

std::string text_of(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

Region region_of(const FieldSource& source, const Question& question) {
  Region region{{}, source.size()};
  for (int d = 0; d < 3; ++d) {
    const auto axis = static_cast<std::size_t>(d);
    const double box = source.size()[d], low = question.low[axis].value_or(0), high = question.high[axis].value_or(box);
    if (!(low < high) || !(low < box) || !(high > 0)) {
      throw FieldRefusal(std::string("the region is ") + "xyz"[d] + " = " + text_of(low) + " to " + text_of(high) +
                         " m; it must rise and meet the box, 0 to " + text_of(box) + " m");
    }
    region.low[d] = std::max(low, 0.0);
    region.high[d] = std::min(high, box);
  }
  return region;
}

std::vector<Quantity> quantities_of(const FieldSource& source, const Question& question,
                                    const std::vector<std::string>& otherwise) {
  std::vector<Quantity> list;
  for (const std::string& name : question.quantities.empty() ? otherwise : question.quantities)
    list.push_back(source.quantity(name));
  constexpr std::size_t most = 64;
  if (list.size() > most)
    throw FieldRefusal(std::to_string(list.size()) + " quantities are asked for; at most 64 are answered at once");
  return list;
}

// Of each cell along a direction, the length within the region.
std::array<std::vector<double>, 3> lengths_of(const FieldSource& source, const Region& region) {
  std::array<std::vector<double>, 3> lengths;
  for (int d = 0; d < 3; ++d) {
    const double h = source.spacing()[d];
    for (int i = 0; i < source.cells()[static_cast<std::size_t>(d)]; ++i)
      lengths[static_cast<std::size_t>(d)].push_back(
          std::max(0.0, std::min((i + 1) * h, region.high[d]) - std::max(i * h, region.low[d])));
  }
  return lengths;
}

// The cells with any share in the region, and the volume of each in it, x fastest.
struct WeightedCells {
  CellBlock block;
  std::vector<double> volumes;
};
WeightedCells cells_in(const FieldSource& source, const Region& region) {
  const auto lengths = lengths_of(source, region);
  WeightedCells cells;
  for (std::size_t d = 0; d < 3; ++d) {
    const auto inside = [](double length) { return length > 0; };
    const auto first = std::find_if(lengths[d].begin(), lengths[d].end(), inside);
    const auto end = std::find_if_not(first, lengths[d].end(), inside);
    cells.block.first[d] = static_cast<int>(first - lengths[d].begin());
    cells.block.count[d] = static_cast<int>(end - first);
  }
  const auto& [first, count] = cells.block;
  for (int k = 0; k < count[2]; ++k)
    for (int j = 0; j < count[1]; ++j)
      for (int i = 0; i < count[0]; ++i)
        cells.volumes.push_back(lengths[0][static_cast<std::size_t>(first[0] + i)] *
                                lengths[1][static_cast<std::size_t>(first[1] + j)] *
                                lengths[2][static_cast<std::size_t>(first[2] + k)]);
  return cells;
}

std::vector<std::size_t> particles_in(const FieldSource& source, const Region& region) {
  const std::vector<double>& x = source.positions();
  std::vector<std::size_t> inside;
  for (std::size_t p = 0; p < x.size() / 3; ++p) {
    bool in = true;
    for (int d = 0; d < 3; ++d) {
      const double place = x[3 * p + static_cast<std::size_t>(d)];
      // What stands on the edge of the box, or a hair beyond it at a wall or outflow, is in a region that reaches that edge.
      in = in && (place >= region.low[d] || region.low[d] == 0) && (place < region.high[d] || region.high[d] == source.size()[d]);
    }
    if (in) inside.push_back(p);
  }
  return inside;
}

std::vector<double> chosen(const std::vector<double>& all, const std::vector<std::size_t>& which) {
  std::vector<double> some;
  some.reserve(which.size());
  for (const std::size_t p : which) some.push_back(all[p]);
  return some;
}

// ---------------------------------------------------------------------------------------------------------- slice

std::vector<double> centres(const FieldSource& source, int d, int first, int count) {
  std::vector<double> places;
  for (int i = first; i < first + count; ++i) places.push_back((i + 0.5) * source.spacing()[d]);
  return places;
}

Answer slice(const FieldSource& source, const Question& question, const SliceQuestion& asked) {
  const auto quantities = quantities_of(source, question, {"gas_fraction"});
  const Region region = region_of(source, question);
  for (const Quantity& quantity : quantities)
    if (quantity.of_particles)
      throw FieldRefusal(quantity.name + " is of particles, a slice is of cells: ask for a sample or a profile");
  const auto axis = static_cast<std::size_t>(asked.axis);
  const double box = source.size()[asked.axis], h = source.spacing()[asked.axis], place = asked.place.value_or(box / 2);
  if (!(place >= 0 && place <= box))
    throw FieldRefusal("the slice is at " + text_of(place) + " m; the box reaches from 0 to " + text_of(box) + " m there");
  CellBlock block;
  for (int d = 0; d < 3; ++d) {  // cells whose centres are in the region
    const auto e = static_cast<std::size_t>(d);
    for (int i = 0; i < source.cells()[e]; ++i) {
      const double centre = (i + 0.5) * source.spacing()[d];
      if (centre < region.low[d] || centre > region.high[d]) continue;
      if (block.count[e]++ == 0) block.first[e] = i;
    }
  }
  block.first[axis] = std::min(static_cast<int>(place / h), source.cells()[axis] - 1);
  block.count[axis] = 1;
  Answer result;
  result.place = (block.first[axis] + 0.5) * h;
  for (int d = 2; d >= 0; --d) {
    if (d == asked.axis) continue;
    const auto e = static_cast<std::size_t>(d);
    result.shape.push_back(static_cast<std::uint64_t>(block.count[e]));
    result.axes.push_back({d, centres(source, d, block.first[e], block.count[e])});
  }
  for (const Quantity& quantity : quantities) {
    result.columns.push_back(quantity);
    result.values.push_back(source.in_cells(quantity.name, block));
  }
  return result;
}

// -------------------------------------------------------------------------------------------------------- profile

// Weighted mean, least and greatest of what falls into each bin.
struct BinnedColumn {
  std::vector<double> sum, weight, minimum, maximum;
  explicit BinnedColumn(std::size_t bins) : sum(bins), weight(bins), minimum(bins, infinity), maximum(bins, -infinity) {}
  void add(std::size_t bin, double value, double w) {
    if (std::isnan(value)) return;
    sum[bin] += w * value;
    weight[bin] += w;
    minimum[bin] = std::min(minimum[bin], value);
    maximum[bin] = std::max(maximum[bin], value);
  }
};

void put(Answer& result, const Quantity& quantity, BinnedColumn column, const Quantity& weight) {
  for (std::size_t bin = 0; bin < column.sum.size(); ++bin) {
    const bool empty = column.weight[bin] == 0;
    column.sum[bin] = empty ? nothing : column.sum[bin] / column.weight[bin];
    if (empty) column.minimum[bin] = column.maximum[bin] = nothing;
  }
  const auto add = [&](const std::string& suffix, const std::string& unit, const std::string& meaning,
                       std::vector<double> values) {
    result.columns.push_back({quantity.name + suffix, unit, meaning, quantity.of_particles});
    result.values.push_back(std::move(values));
  };
  add("", quantity.unit, "mean: " + quantity.meaning, std::move(column.sum));
  add("_minimum", quantity.unit, "minimum in the bin", std::move(column.minimum));
  add("_maximum", quantity.unit, "maximum in the bin", std::move(column.maximum));
  add(weight.name, weight.unit, weight.meaning, std::move(column.weight));
}

void profile_of_cells(const FieldSource& source, const Region& region, int axis, const Quantity& quantity, Answer& result) {
  const WeightedCells cells = cells_in(source, region);
  const std::vector<double> values = source.in_cells(quantity.name, cells.block);
  const auto d = static_cast<std::size_t>(axis);
  std::size_t stride = 1;
  for (std::size_t e = 0; e < d; ++e) stride *= static_cast<std::size_t>(cells.block.count[e]);
  BinnedColumn column(static_cast<std::size_t>(source.cells()[d]));
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t bin =
        static_cast<std::size_t>(cells.block.first[d]) + i / stride % static_cast<std::size_t>(cells.block.count[d]);
    column.add(bin, values[i], cells.volumes[i]);
  }
  put(result, quantity, std::move(column), {"_volume", "m³", "volume of the cells with a value"});
}

Answer profile(const FieldSource& source, const Question& question, const ProfileQuestion& asked) {
  const auto quantities = quantities_of(source, question, {source.has_gas() ? "gas_fraction" : "particle_speed"});
  const Region region = region_of(source, question);
  const auto d = static_cast<std::size_t>(asked.axis);
  const bool of_cells = std::any_of(quantities.begin(), quantities.end(), [](const Quantity& q) { return !q.of_particles; });
  const int bins = asked.bins.value_or(source.has_gas() ? source.cells()[d] : 20);
  if (of_cells && bins != source.cells()[d]) {
    throw FieldRefusal("a profile of " + std::to_string(bins) +
                       " bins is asked for; one of cells has as many as the grid: " + std::to_string(source.cells()[d]));
  }
  constexpr int most_bins = 1'000'000;
  if (bins < 1 || bins > most_bins) throw FieldRefusal("bins is " + std::to_string(bins) + "; allowed are 1 to 1000000");
  Answer result;
  const double width = source.size()[asked.axis] / bins;
  result.shape = {static_cast<std::uint64_t>(bins)};
  result.axes.push_back({asked.axis, {}});
  for (int bin = 0; bin < bins; ++bin) result.axes[0].values.push_back((bin + 0.5) * width);
  std::vector<std::size_t> inside;
  if (source.has_particles()) {
    inside = particles_in(source, region);
    result.particles = inside.size();
  }
  for (const Quantity& quantity : quantities) {
    if (!quantity.of_particles) {
      profile_of_cells(source, region, asked.axis, quantity, result);
      continue;
    }
    const std::vector<double> values = source.of_particles(quantity.name);
    BinnedColumn column(static_cast<std::size_t>(bins));
    for (const std::size_t p : inside) {
      const double place = source.positions()[3 * p + d] / width;
      column.add(static_cast<std::size_t>(std::clamp(place, 0.0, bins - 0.5)), values[p], 1);
    }
    put(result, quantity, std::move(column), {"_count", "1", "particles in the bin"});
  }
  return result;
}

// --------------------------------------------------------------------------------------------------------- sample

// Mixes all bits (Steele, Lea & Flood 2014, SplitMix64).
std::uint64_t mixed(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// Those with the smallest numbers drawn from seed and identity: each as likely as any other, and the same particles in every
// checkpoint of a run.
Answer sample(const FieldSource& source, const Question& question, const SampleQuestion& asked) {
  const auto quantities = quantities_of(source, question,
                                        {"particle_id", "particle_x", "particle_y", "particle_z", "particle_velocity_x",
                                         "particle_velocity_y", "particle_velocity_z", "particle_diameter"});
  const Region region = region_of(source, question);
  for (const Quantity& quantity : quantities)
    if (!quantity.of_particles)
      throw FieldRefusal(quantity.name + " is of cells, a sample is of particles: ask for a slice or a profile");
  if (asked.most < 1 || asked.most * quantities.size() > most_values)
    throw FieldRefusal("a sample of " + std::to_string(asked.most) + " particles is asked for; allowed are 1 to " +
                       std::to_string(most_values / std::max<std::size_t>(quantities.size(), 1)));
  std::vector<std::size_t> which = particles_in(source, region);
  Answer result;
  result.particles = which.size();
  const std::vector<double> ids = source.of_particles("particle_id");
  const auto draw = [&](std::size_t p) { return mixed(mixed(asked.seed) ^ static_cast<std::uint64_t>(ids[p])); };
  if (which.size() > asked.most) {
    std::nth_element(which.begin(), which.begin() + asked.most, which.end(),
                     [&](std::size_t a, std::size_t b) { return std::pair(draw(a), a) < std::pair(draw(b), b); });
    which.resize(asked.most);
  }
  std::sort(which.begin(), which.end(), [&](std::size_t a, std::size_t b) { return ids[a] < ids[b]; });
  result.shape = {which.size()};
  for (const Quantity& quantity : quantities) {
    result.columns.push_back(quantity);
    result.values.push_back(chosen(source.of_particles(quantity.name), which));
  }
  return result;
}

// ------------------------------------------------------------------------------------------------------ reduction

Reduced reduced(const Quantity& quantity, const std::vector<double>& values, const std::vector<double>& weights,
                const ReductionQuestion& asked) {
  Reduced result;
  result.quantity = quantity;
  result.integral_unit = quantity.of_particles ? quantity.unit : quantity.unit == "1" ? "m³" : quantity.unit + "·m³";
  double low = infinity, high = -infinity;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    result.integral += weights[i] * values[i];
    result.weight += weights[i];
    low = std::min(low, values[i]);
    high = std::max(high, values[i]);
  }
  if (result.weight > 0) {
    result.minimum = low, result.maximum = high, result.mean = result.integral / result.weight;
    double squares = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!std::isnan(values[i])) squares += weights[i] * (values[i] - *result.mean) * (values[i] - *result.mean);
    result.deviation = std::sqrt(squares / result.weight);
  }
  if (asked.histogram_bins == 0 || result.weight == 0) return result;
  result.histogram_low = asked.low.value_or(low), result.histogram_high = asked.high.value_or(high);
  if (result.histogram_high == result.histogram_low && !asked.high) result.histogram_high += std::max(std::abs(low), 1.0) * 1e-9;
  if (!(result.histogram_low < result.histogram_high)) {
    throw FieldRefusal("the histogram reaches from " + text_of(result.histogram_low) + " to " + text_of(result.histogram_high) +
                       " " + quantity.unit + "; it must rise");
  }
  result.histogram.assign(static_cast<std::size_t>(asked.histogram_bins), 0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= result.histogram_low && values[i] <= result.histogram_high)) continue;
    const double share = (values[i] - result.histogram_low) / (result.histogram_high - result.histogram_low);
    const auto bin = std::min(static_cast<int>(share * asked.histogram_bins), asked.histogram_bins - 1);
    result.histogram[static_cast<std::size_t>(bin)] += weights[i] / result.weight;
  }
  return result;
}

Answer reduction(const FieldSource& source, const Question& question, const ReductionQuestion& asked) {
  const auto quantities = quantities_of(source, question, {source.has_gas() ? "gas_fraction" : "particle_speed"});
  const Region region = region_of(source, question);
  constexpr int most_bins = 100'000;
  if (asked.histogram_bins < 0 || asked.histogram_bins > most_bins)
    throw FieldRefusal("histogram_bins is " + std::to_string(asked.histogram_bins) + "; allowed are 1 to 100000");
  Answer result;
  std::vector<std::size_t> inside;
  if (source.has_particles()) {
    inside = particles_in(source, region);
    result.particles = inside.size();
  }
  for (const Quantity& quantity : quantities) {
    if (quantity.of_particles) {
      const std::vector<double> values = chosen(source.of_particles(quantity.name), inside);
      result.reduced.push_back(reduced(quantity, values, std::vector<double>(values.size(), 1), asked));
    } else {
      const WeightedCells cells = cells_in(source, region);
      result.reduced.push_back(reduced(quantity, source.in_cells(quantity.name, cells.block), cells.volumes, asked));
    }
  }
  return result;
}

}  // namespace

Answer answer(const FieldSource& source, const Question& question) {
  if (const auto* asked = std::get_if<SliceQuestion>(&question.what)) return slice(source, question, *asked);
  if (const auto* asked = std::get_if<ProfileQuestion>(&question.what)) return profile(source, question, *asked);
  if (const auto* asked = std::get_if<SampleQuestion>(&question.what)) return sample(source, question, *asked);
  return reduction(source, question, std::get<ReductionQuestion>(question.what));
}

}  // namespace bedflow
