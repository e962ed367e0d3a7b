// Sizes of spheres: the laws that diameters are drawn from, their moments, and the moments of those that were drawn.
//
// A law is a density q(d), up to a constant, between a smallest and a largest diameter. It counts particles (number) or what they
// weigh (mass); n(d) ∝ q(d) or q(d)/d³ is then the density of their number.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <variant>
#include <vector>

#include "parallel/comm.h"

namespace bedflow {

enum class Basis { number, mass };  // what a share counts

struct ConstantSize {
  static constexpr const char* name = "constant";
  double diameter = 0;  // m
};

// q = 1
struct UniformSizes {
  static constexpr const char* name = "uniform";
  double smallest = 0, largest = 0;  // m
  double density(double /*d*/) const { return 1; }
};

// q = exp(−(d − mean)²/(2 deviation²)), cut off at both ends
struct NormalSizes {
  static constexpr const char* name = "normal";
  double mean = 0, deviation = 0, smallest = 0, largest = 0;  // m; before cutting
  double density(double d) const { return std::exp(-0.5 * std::pow((d - mean) / deviation, 2)); }
};

// q = exp(−ln²(d/median)/(2 deviation²))/d, cut off at both ends
struct LogNormalSizes {
  static constexpr const char* name = "log_normal";
  double median = 0;                 // m; before cutting
  double deviation = 0;              // of ln d
  double smallest = 0, largest = 0;  // m
  double density(double d) const { return std::exp(-0.5 * std::pow(std::log(d / median) / deviation, 2)) / d; }
};

struct SizeClass {
  double diameter = 0;  // m
  double share = 0;     // of the whole; shares need not add up to 1
};
// q = Σ share_i δ(d − diameter_i)
struct DiscreteSizes {
  static constexpr const char* name = "discrete";
  std::vector<SizeClass> classes;
};
// q = share_i/(diameter_i − diameter_{i−1}) between the diameter of the class before and its own: a sieve analysis
struct HistogramSizes {
  static constexpr const char* name = "histogram";
  double smallest = 0;             // lower end of the first class, m
  std::vector<SizeClass> classes;  // diameters rise
};

using SizeLaw = std::variant<ConstantSize, UniformSizes, NormalSizes, LogNormalSizes, DiscreteSizes, HistogramSizes>;

class SizeDistribution {
 public:
  explicit SizeDistribution(const SizeLaw& law, Basis basis = Basis::number);

  bool constant() const { return smallest() == largest(); }
  double smallest() const { return pieces_.front().low; }  // m
  double largest() const { return pieces_.back().high; }   // m

  // The diameter (m) that the share u of all particles, by number, does not reach. Of a uniform u in [0, 1): one drawn at random.
  double quantile(double u) const;
  // E[dᵏ] over particles, mᵏ, of the law itself.
  double moment(int k) const;
  double mean() const { return moment(1); }
  double sauter() const { return moment(3) / moment(2); }  // d₃₂, m

 private:
  // Of a partition on which the density is smooth; low = high is a single size.
  struct Piece {
    double low = 0, high = 0;  // m
    double factor = 0;         // of the law's density; of a single size the whole of it
    double below = 0;          // share by number of all particles in the pieces before
  };
  double density(const Piece& piece, double d) const;  // of number
  double integral(const Piece& piece, double high, int k) const;
  void add_smooth(double low, double high, double widest, double ratio, double factor = 1);
  void add_pieces(const ConstantSize& law);
  void add_pieces(const UniformSizes& law);
  void add_pieces(const NormalSizes& law);
  void add_pieces(const LogNormalSizes& law);
  void add_pieces(const DiscreteSizes& law);
  void add_pieces(const HistogramSizes& law);

  SizeLaw law_;
  Basis basis_;
  std::vector<Piece> pieces_;
};

// Moments of the spheres that there are.
struct SizeMoments {
  std::int64_t count = 0;
  double mean = 0, deviation = 0;    // m
  double sauter = 0;                 // d₃₂ = Σd³/Σd², m
  double smallest = 0, largest = 0;  // m
  double mass = 0;                   // kg
};

class SizeSums {
 public:
  explicit SizeSums(double reference)
      : reference_(reference) {}  // any size of the scene, m: keeps round-off out of the deviation
  void add(double diameter, double mass);
  SizeMoments over_all(const Comm& comm) const;  // collective

 private:
  double reference_;
  std::int64_t count_ = 0;
  std::array<double, 5> sums_{};  // of d − reference, its square, d², d³, and the mass
  double smallest_ = std::numeric_limits<double>::infinity(), largest_ = 0;
};

}  // namespace bedflow
