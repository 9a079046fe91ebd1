// core/base/field.h - an implicit function handed over as a callback, so that mesh, point_volume and splats
// never learn which model stands behind it.
#pragma once
#include <functional>
#include <span>

#include "core/base/vec3.h"

namespace spinaltap {

/// s(x) in mm, patient frame, negative inside bone; close to a signed distance near the surface.
struct Field {
  /// values(points, out): out[i] = s(points[i]). Both spans have one length. Safe to call from several threads.
  std::function<void(std::span<const Vec3>, std::span<double>)> values;
  /// gradients(points, out): out[i] = grad s(points[i]), not normalised; finite everywhere.
  std::function<void(std::span<const Vec3>, std::span<Vec3>)> gradients;
  /// |s(a) - s(b)| <= lipschitz * |a - b| in the region of interest; +infinity when nothing is known.
  double lipschitz = 0;
  /// How far `values` may be from s, as sums that are made fast are; who asks on which side of the surface a point lies
  /// asks `exact` where they are no farther from 0 than this.
  double error_mm = 0;
  /// s itself, one value for a point whatever is asked along with it. Empty: `values` are s. Safe as `values` is.
  std::function<void(std::span<const Vec3>, std::span<double>)> exact;
};

}  // namespace spinaltap
