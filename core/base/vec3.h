// core/base/vec3.h - three doubles, and the few operations on them that every module needs.
// Only + - * / and sqrt are used, so results are the same bits on every target.
#pragma once
#include <cmath>

namespace spinaltap {

struct Vec3 {
  double x = 0, y = 0, z = 0;

  constexpr Vec3& operator+=(const Vec3& o) {
    x += o.x, y += o.y, z += o.z;
    return *this;
  }
  constexpr Vec3& operator-=(const Vec3& o) {
    x -= o.x, y -= o.y, z -= o.z;
    return *this;
  }
  constexpr Vec3& operator*=(double s) {
    x *= s, y *= s, z *= s;
    return *this;
  }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

constexpr Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
constexpr Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(Vec3 a, double s) { return a *= s; }
constexpr Vec3 operator*(double s, Vec3 a) { return a *= s; }
constexpr Vec3 operator/(const Vec3& a, double s) { return {a.x / s, a.y / s, a.z / s}; }

constexpr double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
/// @pre norm(a) > 0.
inline Vec3 normalized(const Vec3& a) { return a / norm(a); }
inline bool isFinite(const Vec3& a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

/// Three columns; used for grid directions and rotations.
struct Mat3 {
  Vec3 col_x{1, 0, 0}, col_y{0, 1, 0}, col_z{0, 0, 1};
  friend constexpr bool operator==(const Mat3&, const Mat3&) = default;
};
constexpr Vec3 operator*(const Mat3& m, const Vec3& v) { return m.col_x * v.x + m.col_y * v.y + m.col_z * v.z; }
/// The product of the transpose of m with v: the inverse rotation when m is orthonormal.
constexpr Vec3 transposeTimes(const Mat3& m, const Vec3& v) {
  return {dot(m.col_x, v), dot(m.col_y, v), dot(m.col_z, v)};
}

}  // namespace spinaltap
