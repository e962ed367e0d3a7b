#include "statistics_state.h"

#include <cstring>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace bedflow {

namespace {

// What the sums belong to.
std::string signature_of(const Monitors& monitors) {
  std::ostringstream text;
  text.precision(17);
  for (std::size_t m = 0; m < monitors.size(); ++m) {
    const MonitorSetup& setup = monitors.setup(m);
    text << setup.name << ' ' << monitors.meaning(m) << ' ' << monitors.places(m).size() << ' ' << setup.interval << ' '
         << setup.averaging_start << ' ' << setup.averaging_bin << ' ' << setup.averaging_bins << '\n';
  }
  return std::move(text).str();
}

}  // namespace

void add_statistics(const Monitors& monitors, CheckpointContent& content) {
  const std::vector<double> state = monitors.state();
  const auto bytes = std::as_bytes(std::span(state));
  const std::string sums(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  content.arrays.push_back({"statistics/state", "", "sums of the monitors, in the order of the case", sums, {}, 1});
  content.arrays.push_back({"statistics/monitors", "", "what the sums belong to", signature_of(monitors), {}, 1});
}

bool restore_statistics(const CheckpointReader& reader, Monitors& monitors) {
  if (reader.text("statistics/monitors") != signature_of(monitors)) return false;
  const std::string state = reader.text("statistics/state");
  std::vector<double> values(state.size() / sizeof(double));
  std::memcpy(values.data(), state.data(), values.size() * sizeof(double));
  monitors.restore(values);
  return true;
}

}  // namespace bedflow
