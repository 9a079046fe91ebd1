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
/// + - * and comparisons only; no fused multiply-add.
[[nodiscard]] inline bool isInside(const BitShape& bit, const Vec3& tip_mm, const Vec3& axis, const Vec3& point_mm) {
  const Vec3 from_tip = point_mm - tip_mm;
  const double along = -dot(from_tip, axis);
  if (along < -kTouch_mm || along > bit.length_mm + kTouch_mm) return false;
  const Vec3 radial = from_tip + axis * along;  // no cancellation of squares far up the shaft
  const double distance_squared = dot(radial, radial);
  if (along >= bit.cone_mm) return distance_squared <= bit.radius_squared;
  const double cone_radius = (along > 0 ? along * bit.radius_per_cone : 0.0) + kTouch_mm;
  return distance_squared <= cone_radius * cone_radius;
}

}  // namespace spinaltap::drill
