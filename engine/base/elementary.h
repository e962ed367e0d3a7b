// Exponential, logarithm, power and arctangent that the compiler vectorises: no branch, no table, no errno. Series of known
// remainder, so that both are right to a few units in the last place; tests/unit/elementary_test.cpp holds them against the C
// library.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace bedflow {

inline constexpr auto inverses = [] {  // 1/n
  std::array<double, 26> values{};
  for (int n = 1; n < 26; ++n) values[n] = 1.0 / n;
  return values;
}();
inline constexpr auto inverse_factorials = [] {  // 1/n!
  std::array<double, 14> values{1};
  for (int n = 1; n < 14; ++n) values[n] = values[n - 1] / n;
  return values;
}();

// log2 x of a normal x > 0; −1023 of 0. With x = 2^k m, m in [√½, √2), and s = (m − 1)/(m + 1), |s| < 0.172:
//   ln m = 2 artanh s = 2 (s + s³/3 + s⁵/5 + …);  what is left out is below 1e-18.
inline double logarithm2(double x) {
  constexpr auto least = std::bit_cast<std::int64_t>(0.70710678118654752);
  const auto bits = std::bit_cast<std::int64_t>(x);
  const std::int64_t exponent = (bits - least) >> 52;
  const double m = std::bit_cast<double>(bits - (exponent << 52));
  const double s = (m - 1) / (m + 1), z = s * s;
  double series = inverses[23];
  for (int n = 21; n > 0; n -= 2) series = series * z + inverses[n];
  return static_cast<double>(exponent) + 2 * std::numbers::log2e * s * series;
}

// 2^t; the smallest or largest normal number of its kind where t leaves ±1022. With n the integer next to t and f = t − n:
//   2^t = 2^n e^(f ln 2),  |f ln 2| < 0.347;  the Taylor series to f¹³ leaves out less than 1e-17.
inline double exponential2(double t) {
  constexpr double shift = 0x1.8p52;  // t + shift has the integer next to t in its last bits
  const double rounded = std::clamp(t, -1022.0, 1022.0) + shift;
  const double y = (std::clamp(t, -1022.0, 1022.0) - (rounded - shift)) * std::numbers::ln2;
  double series = inverse_factorials[13];
  for (int n = 12; n >= 0; --n) series = series * y + inverse_factorials[n];
  return std::bit_cast<double>(std::bit_cast<std::int64_t>(series) + (std::bit_cast<std::int64_t>(rounded) << 52));
}

inline double exponential(double x) {
  return exponential2(std::numbers::log2e * x);
}
inline double logarithm(double x) {
  return std::numbers::ln2 * logarithm2(x);
}
// x^y of a normal x > 0; next to 0 for x = 0 and y > 0.01.
inline double power(double x, double y) {
  return exponential2(y * logarithm2(x));
}

// arctan x: of 1/x beyond 1, and by arctan u = arctan c + arctan((u − c)/(1 + u c)) brought within tan(π/16) = 0.199 of 0, with
// c = 0, tan(π/8) or 1; the Taylor series then leaves out less than 1e-17.
inline double arctangent(double x) {
  constexpr double pi = std::numbers::pi, sixteenth = 0.19891236737965800691, eighth = 0.41421356237309504880;
  constexpr double three_sixteenths = 0.66817863791929891999;
  const double size = std::abs(x), a = std::min(size, 1.0), b = std::max(size, 1.0);  // u = a/b
  const bool low = a < sixteenth * b, middle = a < three_sixteenths * b;
  const double c = low ? 0 : middle ? eighth : 1;
  const double w = (a - c * b) / (b + c * a), z = w * w;
  double series = inverses[25];
  for (int n = 23; n > 0; n -= 2) series = inverses[n] - series * z;
  const double within = (low ? 0 : middle ? pi / 8 : pi / 4) + w * series;
  return std::copysign(size > 1 ? pi / 2 - within : within, x);
}

}  // namespace bedflow
