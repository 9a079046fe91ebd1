// core/rbf/smoothing.h - how noisy samples are, and how much smoothing that asks for (internal).
#pragma once
#include <span>

#include "core/base/vec3.h"

namespace spinaltap::rbf {

/// Root mean square of the values' noise: what a quadratic through some sixty neighbours leaves, the median over places
/// all over the set. Where one error moves several samples (a boundary point and those along its normal) it comes out
/// some tenth too small; where the function bends within the neighbourhood, too large.
/// @pre at least 4 points. @return 0 for fewer points than a quadratic can be tested with.
[[nodiscard]] double estimateNoise(std::span<const Vec3> points, std::span<const double> values, unsigned threads);

/// The ridge with which a fit leaves residuals of about `noise` (root mean square), found on a few patches of the set.
/// 0 when even none leaves that much. After Morozov's discrepancy principle.
[[nodiscard]] double ridgeFor(double noise, std::span<const Vec3> points, std::span<const double> values,
                              unsigned threads);

}  // namespace spinaltap::rbf
