// Three components, and nothing else: positions, velocities, forces. Of a double (Vec3), or of a pack for as many contacts at
// once.
#pragma once

#include "base/simd.h"

namespace bedflow {

template <class Real>
struct Vector3 {
  Real x{}, y{}, z{};

  Real& operator[](int d) { return (&x)[d]; }
  const Real& operator[](int d) const { return (&x)[d]; }
  Vector3& operator+=(Vector3 b) { return x += b.x, y += b.y, z += b.z, *this; }
  Vector3& operator-=(Vector3 b) { return x -= b.x, y -= b.y, z -= b.z, *this; }
  Vector3& operator*=(Real s) { return x *= s, y *= s, z *= s, *this; }
  bool operator==(const Vector3&) const = default;
};
using Vec3 = Vector3<double>;

template <class Real>
Vector3<Real> operator+(Vector3<Real> a, Vector3<Real> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Real>
Vector3<Real> operator-(Vector3<Real> a, Vector3<Real> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Real>
Vector3<Real> operator-(Vector3<Real> a) {
  return {-a.x, -a.y, -a.z};
}
template <class Real>
Vector3<Real> operator*(std::type_identity_t<Real> s, Vector3<Real> a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <PackLike Real>
Vector3<Real> operator*(double s, Vector3<Real> a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class Real>
Real dot(Vector3<Real> a, Vector3<Real> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
Vector3<Real> cross(Vector3<Real> a, Vector3<Real> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class Real>
Real norm(Vector3<Real> a) {
  return sqrt(dot(a, a));
}

}  // namespace bedflow
