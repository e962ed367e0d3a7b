// Slices, profiles, samples and reductions of a checkpoint: the questions, and the arithmetic of their answers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "fields/quantities.h"

namespace bedflow {

// A box in the box, m.
struct Region {
  Vec3 low, high;
};

struct SliceQuestion {
  int axis = 2;
  std::optional<double> place{};  // m; the middle if absent
};
struct ProfileQuestion {
  int axis = 1;
  std::optional<int> bins{};
};
struct SampleQuestion {
  std::uint32_t most = 1000;
  std::uint64_t seed = 0;
};
struct ReductionQuestion {
  int histogram_bins = 0;
  std::optional<double> low{}, high{};  // of the histogram
};

struct Question {
  std::vector<std::string> quantities;                 // some that suit if empty
  std::array<std::optional<double>, 3> low{}, high{};  // of the region, m; the box's edges if absent
  std::variant<SliceQuestion, ProfileQuestion, SampleQuestion, ReductionQuestion> what;
};

struct Reduced {
  Quantity quantity;
  std::optional<double> minimum, maximum, mean, deviation;  // nothing where nothing has a value
  double integral = 0, weight = 0;                          // Σ w q, Σ w: w the volume of a cell in the region, m³, or 1
  std::string integral_unit;
  double histogram_low = 0, histogram_high = 0;
  std::vector<double> histogram{};  // shares of the weight
};

struct Places {
  int axis = 0;
  std::vector<double> values;  // m
};

struct Answer {
  std::vector<Quantity> columns;
  std::vector<std::vector<double>> values;  // one a column; of the shape, the last axis fastest
  std::vector<std::uint64_t> shape;
  std::vector<Places> axes;
  std::optional<double> place;             // m
  std::optional<std::uint64_t> particles;  // in the region
  std::vector<Reduced> reduced;
};

// Throws FieldRefusal for a question that makes no sense, Stop(checkpoint_corrupt) for a file that is not good.
Answer answer(const FieldSource& source, const Question& question);

}  // namespace bedflow
