// core/segment/distance.h - Euclidean distances to a mask, in mm (internal to segment).
// After: Felzenszwalb and Huttenlocher, "Distance Transforms of Sampled Functions", Theory of Computing 8 (2012).
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/base/vec3.h"

namespace spinaltap::segment {

/// A block of voxels, i fastest.
struct Mask {
  std::array<int, 3> dims{0, 0, 0};
  Vec3 spacing_mm{1, 1, 1};
  std::vector<std::uint8_t> set;  ///< #voxels, 0 or 1

  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(dims[0]) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(k));
  }
};

/// Square of the distance from each voxel centre to the nearest voxel centre whose value is `wanted`; very large (1e30
/// and more) when there is none.
/// @cost linear: three passes.
[[nodiscard]] std::vector<float> squaredDistances(const Mask& mask, std::uint8_t wanted);

/// Voxels whose centre is within radius_mm of a set one; and those farther than radius_mm from every unset one.
[[nodiscard]] Mask dilated(const Mask& mask, double radius_mm);
[[nodiscard]] Mask eroded(const Mask& mask, double radius_mm);

}  // namespace spinaltap::segment
