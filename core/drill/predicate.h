// core/drill/predicate.h - the one test that decides whether a point is inside the bit.
#pragma once
#include "core/base/vec3.h"
#include "core/plan/path.h"

namespace spinaltap::drill {

/// The bit is a closed set, widened by this much: far above rounding (coordinates up to 300 mm in double leave
/// errors below 1e-11 mm) and far below any spacing. So a ring exactly as wide as the bit goes whole, never half.
inline constexpr double kTouch_mm = 1e-9;

/// The bit's numbers in the form the predicate uses.
struct BitShape {
  double radius_mm, cone_mm, length_mm;
  double radius_squared;   ///< (radius + touch)^2
  double radius_per_cone;  ///< radius / cone, 0 for a flat end
};
[[nodiscard]] BitShape shapeOf(const plan::Bit& bit);

/// Behind the tip along the shaft: a = -(p - tip) . axis. Inside: -touch <= a <= length + touch, and the distance from
/// the axis is at most radius (a >= cone) or radius * a / cone + touch (a < cone).
/// + - * and comparisons only; no fused multiply-add. T is what it reckons in.
template <class T = double>
[[nodiscard]] inline bool isInside(const BitShape& bit, const Vec3& tip_mm, const Vec3& axis, const Vec3& point_mm) {
  const auto t = [](double value) { return static_cast<T>(value); };
  const T x = t(point_mm.x) - t(tip_mm.x), y = t(point_mm.y) - t(tip_mm.y), z = t(point_mm.z) - t(tip_mm.z);
  const T ax = t(axis.x), ay = t(axis.y), az = t(axis.z);
  const T along = -(x * ax + y * ay + z * az);
  if (along < -t(kTouch_mm) || along > t(bit.length_mm + kTouch_mm)) return false;
  const T rx = x + ax * along, ry = y + ay * along, rz = z + az * along;  // no cancellation of squares far up the shaft
  const T distance_squared = rx * rx + ry * ry + rz * rz;
  if (along >= t(bit.cone_mm)) return distance_squared <= t(bit.radius_squared);
  const T cone_radius = (along > 0 ? along * t(bit.radius_per_cone) : T{0}) + t(kTouch_mm);
  return distance_squared <= cone_radius * cone_radius;
}

/// In single precision a point is judged as if the bit's surface were at most so far from where it is, for points and
/// tips at most `size_mm` from the origin of the path frame.
///
/// With u = 2^-24 and s = size: rounding the inputs moves a coordinate's difference by 2 u s, subtracting by another
/// 2 u s. The dot product takes that times at most sqrt(3), and rounds the axis, three products and two sums of terms
/// that are at most 2 s together: 7 u s + 12 u s. The radial vector adds coordinate and product: 4 u s + 19 u s +
/// 2 u (4 s). So its length, the same squared and summed with three roundings of relative size (radius <= 2 s: 6 u s),
/// is known to 37 u s; against the cone, whose radius is along * slope, another slope times 19 u s and two roundings
/// (4 u s slope). 64 (1 + slope) u s is above all of them; the touch is lost in it.
[[nodiscard]] inline double singleError_mm(const BitShape& bit, double size_mm) {
  return 64.0 * (1.0 + bit.radius_per_cone) * 0x1p-24 * size_mm;
}

}  // namespace spinaltap::drill
