// A function of x, y, z and t with its first and second derivatives, carried along by the chain rule: what a manufactured
// solution needs for exact source terms.
#pragma once

#include <array>
#include <cmath>

namespace bedflow {

struct Smooth {
  double value = 0;
  std::array<double, 4> slope{};                // ∂/∂(x, y, z, t)
  std::array<std::array<double, 4>, 4> bend{};  // second derivatives

  Smooth() = default;
  Smooth(double constant) : value(constant) {}  // NOLINT(google-explicit-constructor): a number is a constant function
  static Smooth variable(int which, double at) {
    Smooth result(at);
    result.slope[which] = 1;
    return result;
  }
};

// f(g), from f, f' and f'' at g.
inline Smooth chain(const Smooth& g, double f, double first, double second) {
  Smooth result(f);
  for (int a = 0; a < 4; ++a) {
    result.slope[a] = first * g.slope[a];
    for (int b = 0; b < 4; ++b) result.bend[a][b] = first * g.bend[a][b] + second * g.slope[a] * g.slope[b];
  }
  return result;
}
inline Smooth sin(const Smooth& g) {
  return chain(g, std::sin(g.value), std::cos(g.value), -std::sin(g.value));
}
inline Smooth cos(const Smooth& g) {
  return chain(g, std::cos(g.value), -std::sin(g.value), -std::cos(g.value));
}
inline Smooth reciprocal(const Smooth& g) {
  const double f = 1 / g.value;
  return chain(g, f, -f * f, 2 * f * f * f);
}

inline Smooth operator+(const Smooth& f, const Smooth& g) {
  Smooth result(f.value + g.value);
  for (int a = 0; a < 4; ++a) {
    result.slope[a] = f.slope[a] + g.slope[a];
    for (int b = 0; b < 4; ++b) result.bend[a][b] = f.bend[a][b] + g.bend[a][b];
  }
  return result;
}
inline Smooth operator*(const Smooth& f, const Smooth& g) {
  Smooth result(f.value * g.value);
  for (int a = 0; a < 4; ++a) {
    result.slope[a] = f.slope[a] * g.value + f.value * g.slope[a];
    for (int b = 0; b < 4; ++b) {
      result.bend[a][b] = f.bend[a][b] * g.value + f.slope[a] * g.slope[b] + f.slope[b] * g.slope[a] + f.value * g.bend[a][b];
    }
  }
  return result;
}
inline Smooth operator-(const Smooth& f, const Smooth& g) {
  return f + Smooth(-1) * g;
}
inline Smooth operator/(const Smooth& f, const Smooth& g) {
  return f * reciprocal(g);
}

}  // namespace bedflow
