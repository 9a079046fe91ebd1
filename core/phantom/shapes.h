// core/phantom/shapes.h - distances to simple shapes and smooth ways to join them. All mm; negative inside.
// Each is exact, or has a gradient no longer than its comment says, so that bounds survive the joining.
#pragma once
#include <algorithm>
#include <cmath>

#include "core/base/vec3.h"

namespace spinaltap::phantom {

/// Union that fills the crease within k. Its gradient is a convex combination of the two, so the larger bound holds.
inline double smoothMin(double a, double b, double k) {
  const double h = std::max(k - std::fabs(a - b), 0.0) / k;
  return std::min(a, b) - 0.25 * h * h * k;
}
inline double smoothMax(double a, double b, double k) { return -smoothMin(-a, -b, k); }

/// 0 below `low`, 1 above `high`, smooth between. Slope at most 1.5 / (high - low).
inline double smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// A flat rectangle with rounded corners: given a thickness, the blank from which processes and plates are made.
struct Plate {
  Vec3 centre;
  Vec3 along, across;  ///< orthonormal, in the rectangle's plane
  double half_length = 0, half_width = 0;
  double corner = 0;  ///< radius of the corners, at most the smaller half, wherever the taper makes it smallest

  struct Local {
    double along, across;  ///< the place on the rectangle, clamped to it
    double off;            ///< height over its plane, signed
    double distance;       ///< to the rounded rectangle
  };
  /// @param taper  change of half_width per mm along.  Gradient of `distance` at most 1 + |taper|.
  [[nodiscard]] Local nearest(const Vec3& p, double taper = 0) const {
    const Vec3 d = p - centre;
    const double u = dot(d, along), v = dot(d, across), w = dot(d, cross(along, across));
    const double cu = std::clamp(u, -half_length, half_length);
    const double half = half_width + taper * cu;
    const double du = std::max(std::fabs(u) - (half_length - corner), 0.0);
    const double dv = std::max(std::fabs(v) - (half - corner), 0.0);
    const double in_plane = std::max(std::sqrt(du * du + dv * dv) - corner, 0.0);
    return {cu, std::clamp(v, -half, half), w, std::sqrt(in_plane * in_plane + w * w)};
  }
};

/// Round cone-like capsule. Gradient at most sqrt(1 + ((rb - ra) / |b - a|)^2).
inline double capsule(const Vec3& p, const Vec3& a, const Vec3& b, double ra, double rb) {
  const Vec3 ab = b - a, ap = p - a;
  const double h = std::clamp(dot(ap, ab) / dot(ab, ab), 0.0, 1.0);
  return norm(ap - ab * h) - (ra + (rb - ra) * h);
}

}  // namespace spinaltap::phantom
