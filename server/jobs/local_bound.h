// server/jobs/local_bound.h - how steep a model can be near a path, proved. A model's own bound, |c| + sum |w|, is some
// hundred times too large, and a point volume is decided the sooner the smaller the bound is.
#pragma once
#include "core/base/frame.h"
#include "core/rbf/rbf.h"

namespace spinaltap::jobs {

/// Along z of the frame, from low_z to high_z, with this radius.
struct Cylinder {
  Frame frame;
  double radius_mm = 0, low_z_mm = 0, high_z_mm = 0;
};

/// |s(a) - s(b)| <= this * |a - b| for all a, b in the cylinder (which is convex, so the steepest slope in it will do).
/// Cubes cover the cylinder; in the ball around a cube the slope is at most that at its centre, plus radius times the
/// norm of the second derivative there, plus what the third can add (1.155 |w| / distance^2 a centre); centres in or
/// near the ball count with their whole weight. Cubes where that is not good enough are split, down to half a
/// millimetre.
/// @param threads 0: all; the same bits from any number.
/// @cost  about as much as some thousand gradients.
[[nodiscard]] double lipschitzIn(const rbf::Model& model, const Cylinder& cylinder, unsigned threads = 0);

}  // namespace spinaltap::jobs
