// core/segment/filter.h - separable filters on blocks of voxels (internal to segment).
#pragma once
#include <array>
#include <vector>

#include "core/base/vec3.h"

namespace spinaltap::segment {

/// Gaussian blur, cut at three standard deviations, edges repeated. @param sigma  in voxels, by axis; below a quarter
/// of one the axis is left alone.
void blur(std::vector<float>& values, const std::array<int, 3>& dims, const Vec3& sigma, unsigned threads);

/// Largest value within `reach` voxels along each axis (a box).
void dilateGrey(std::vector<float>& values, const std::array<int, 3>& dims, const std::array<int, 3>& reach,
                unsigned threads);

}  // namespace spinaltap::segment
