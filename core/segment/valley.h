// core/segment/valley.h - how much a voxel lies in a dark sheet between bright ones (internal to segment).
// A joint space narrower than a voxel leaves no dark voxel behind, only such a valley in the bone's HU.
// After: Sato et al., "Tissue classification based on 3D local intensity structures", IEEE TVCG 6 (2000).
#pragma once
#include <vector>

#include "core/segment/block.h"

namespace spinaltap::segment {

/// Largest eigenvalue of the Hessian of `values` (HU per step squared), 0 where it is negative, at the block's edge and
/// where `values` are below least_hu.
[[nodiscard]] std::vector<float> valleyDepth(const Block& block, const std::vector<float>& values, double least_hu,
                                             unsigned threads);

}  // namespace spinaltap::segment
