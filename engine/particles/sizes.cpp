#include "particles/sizes.h"

#include <algorithm>
#include <span>

namespace bedflow {

namespace {

// Gauss–Legendre, 8 points: to round-off on a piece, where a density changes by less than e² and d by a quarter.
constexpr std::array<double, 4> nodes{0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
constexpr std::array<double, 4> weights{0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

template <class Function>
double integrate_over(double low, double high, Function function) {
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  double sum = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    sum += weights[i] * (function(middle - half * nodes[i]) + function(middle + half * nodes[i]));
  return half * sum;
}

constexpr double widest_ratio = 1.25;  // of the ends of a piece: powers of d are smooth on it
constexpr double furthest = 15;        // deviations from the middle: beyond them no double is left of a Gaussian

}  // namespace

SizeDistribution::SizeDistribution(const SizeLaw& law, Basis basis) : law_(law), basis_(basis) {
  std::visit([&](const auto& kind) { add_pieces(kind); }, law_);
  double total = 0;
  for (Piece& piece : pieces_) {
    piece.below = total;
    total += integral(piece, piece.high, 0);
  }
  for (Piece& piece : pieces_) {
    piece.factor /= total;
    piece.below /= total;
  }
}

// ---------------------------------------------------------------------------------------------------- pieces

void SizeDistribution::add_smooth(double low, double high, double widest, double ratio, double factor) {
  while (low < high) {
    double next = std::min(low + widest, low * std::min(ratio, widest_ratio));
    if (!(next < high * (1 - 1e-9))) next = high;
    pieces_.push_back({low, next, factor, 0});
    low = next;
  }
}

void SizeDistribution::add_pieces(const ConstantSize& law) {
  pieces_.push_back({law.diameter, law.diameter, 1, 0});
}

void SizeDistribution::add_pieces(const UniformSizes& law) {
  add_smooth(law.smallest, law.largest, law.largest, widest_ratio);
}

void SizeDistribution::add_pieces(const NormalSizes& law) {
  const double low = std::max(law.smallest, law.mean - furthest * law.deviation);
  add_smooth(low, std::min(law.largest, law.mean + furthest * law.deviation), law.deviation / 2, widest_ratio);
}

void SizeDistribution::add_pieces(const LogNormalSizes& law) {
  const double reach = std::exp(furthest * law.deviation);
  const double low = std::max(law.smallest, law.median / reach);
  add_smooth(low, std::min(law.largest, law.median * reach), law.largest, std::exp(law.deviation / 2));
}

void SizeDistribution::add_pieces(const DiscreteSizes& law) {
  for (const SizeClass& size : law.classes) pieces_.push_back({size.diameter, size.diameter, size.share, 0});
  std::ranges::sort(pieces_, {}, &Piece::low);
  if (basis_ == Basis::mass)
    for (Piece& piece : pieces_) piece.factor /= piece.low * piece.low * piece.low;
}

void SizeDistribution::add_pieces(const HistogramSizes& law) {
  double low = law.smallest;
  for (const SizeClass& size : law.classes) {
    if (size.share > 0) add_smooth(low, size.diameter, size.diameter, widest_ratio, size.share / (size.diameter - low));
    low = size.diameter;
  }
}

// ---------------------------------------------------------------------------------------------------- by number

double SizeDistribution::density(const Piece& piece, double d) const {
  const double q = std::visit(
      [&](const auto& law) {
        if constexpr (requires { law.density(d); }) return law.density(d);
        return 1.0;
      },
      law_);
  return piece.factor * (basis_ == Basis::mass ? q / (d * d * d) : q);
}

// ∫ dᵏ n dd from the piece's low end to `high`.
double SizeDistribution::integral(const Piece& piece, double high, int k) const {
  if (piece.low == piece.high) return piece.factor * std::pow(piece.low, k);
  return integrate_over(piece.low, high, [&](double d) { return std::pow(d, k) * density(piece, d); });
}

double SizeDistribution::moment(int k) const {
  double sum = 0;
  for (const Piece& piece : pieces_) sum += integral(piece, piece.high, k);
  return sum;
}

// Newton's method within the piece, by halves where it would leave what is known to hold the solution.
double SizeDistribution::quantile(double u) const {
  const auto after =
      std::upper_bound(pieces_.begin() + 1, pieces_.end(), u, [](double share, const Piece& p) { return share < p.below; });
  const Piece& piece = *(after - 1);
  double low = piece.low, high = piece.high;
  if (low == high) return low;
  const double wanted = u - piece.below, whole = integral(piece, piece.high, 0);
  double d = low + (high - low) * std::clamp(wanted / whole, 0.0, 1.0);
  for (int round = 0; round < 60 && high - low > 1e-15 * high; ++round) {
    const double miss = integral(piece, d, 0) - wanted;
    (miss > 0 ? high : low) = d;
    const double next = d - miss / density(piece, d);
    if (std::abs(next - d) <= 1e-14 * d) break;
    d = next > low && next < high ? next : 0.5 * (low + high);
  }
  return d;
}

// ---------------------------------------------------------------------------------------------------- what there is

void SizeSums::add(double diameter, double mass) {
  const double off = diameter - reference_, d2 = diameter * diameter;
  const std::array<double, 5> terms{off, off * off, d2, d2 * diameter, mass};
  for (std::size_t i = 0; i < terms.size(); ++i) sums_[i] += terms[i];
  smallest_ = std::min(smallest_, diameter);
  largest_ = std::max(largest_, diameter);
  ++count_;
}

SizeMoments SizeSums::over_all(const Comm& comm) const {
  std::array<double, 5> sums = sums_;
  comm.sum(sums);
  SizeMoments moments;
  moments.count = comm.sum(count_);
  const double smallest = comm.min(smallest_), largest = comm.max(largest_);
  if (moments.count == 0) return moments;
  const double n = static_cast<double>(moments.count), off = sums[0] / n;
  moments.mean = reference_ + off;
  moments.deviation = std::sqrt(std::max(0.0, sums[1] / n - off * off));
  moments.sauter = sums[3] / sums[2];
  moments.smallest = smallest;
  moments.largest = largest;
  moments.mass = sums[4];
  return moments;
}

}  // namespace bedflow
