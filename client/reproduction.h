// A published bed beside its experiment and the models it has been computed with: what is run, and the page that tells of it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bedflow/v1/service.pb.h"

namespace bedflow::client {

struct Averaging {
  double start = 0, bin = 0;  // s
  std::uint32_t bins = 0;
};

std::vector<std::string> published_conditions();  // ready cases: "goldschmidt-1.5", "mueller"
// Those of a bed: of "goldschmidt" all its conditions, of "goldschmidt-1.5" this one. Throws Failure with those there
// are.
std::vector<std::string> conditions_of(const std::string& bed);
// A run of each condition with each preset, every averaged monitor by this averaging, ended with its last bin. Every run packs
// its own bed: the presets differ in the contacts that it rests on.
v1::StudySpec reproduction(const std::vector<std::string>& conditions, const std::vector<std::string>& presets,
                           const std::optional<Averaging>& averaging);

// One run: its case, and what its averages are.
struct ReproducedRun {
  std::string condition, preset;
  v1::Case scene;
  v1::Statistics statistics;
  double cost = 0;  // CPU seconds per simulated second
};

// a ± δa and b ± δb agree when this is not positive: (|a − b| − δa − δb) / ((a + b)/2), the measure of arXiv 1909.02067.
double disagreement(double a, double half_a, double b, double half_b);
// Mean of a profile and its mirror image about the middle of its places.
std::vector<double> mirrored(const std::vector<double>& values);

// Writes folder/NAME.md and a picture for each monitor with references; returns the page's path. Throws Failure.
std::filesystem::path write_page(const std::filesystem::path& folder, const std::string& name, const std::string& command,
                                 const std::vector<ReproducedRun>& runs);

}  // namespace bedflow::client
