// core/segment/block.h - the CT round a seed on an isotropic grid along the patient's axes (internal to segment).
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "core/base/result.h"
#include "core/volume/grid.h"

namespace spinaltap::segment {

/// Voxel (i, j, k) lies at low_mm + (i, j, k) * step_mm, in mm from the seed along the patient's axes (x to the left,
/// y to the back, z to the head). So a block does not depend on how the scanner's grid is turned or how far away its
/// origin is.
struct Block {
  std::array<int, 3> dims{0, 0, 0};
  double step_mm = 1;
  Vec3 low_mm;
  std::vector<float> hu;            ///< #voxels, i fastest
  std::vector<std::uint8_t> known;  ///< #voxels, 0 where the CT does not reach: hu is that of its edge there

  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(dims[0]) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(k));
  }
  [[nodiscard]] Vec3 place(int i, int j, int k) const { return low_mm + Vec3{1.0 * i, 1.0 * j, 1.0 * k} * step_mm; }
  [[nodiscard]] Vec3 voxelAt(const Vec3& place_mm) const { return (place_mm - low_mm) / step_mm; }
};

/// The values between the voxels of a block, trilinear; beyond its edge that of the nearest voxel.
[[nodiscard]] double valueAt(const Block& block, const std::vector<float>& values, const Vec3& place_mm);
/// Whether the CT reaches the place.
[[nodiscard]] bool isKnown(const Block& block, const Vec3& place_mm);

/// Resamples low_mm .. high_mm round the seed; voxels finer than the step are averaged first.
/// @pre a grid that passes volume::checkGrid, low_mm < high_mm, step_mm > 0. The block is cut where the CT ends.
[[nodiscard]] Block blockAround(const volume::CtVolume& ct, const Vec3& seed_patient, const Vec3& low_mm,
                                const Vec3& high_mm, double step_mm, unsigned threads);

/// Gaussian blur of a block's values (filter.h).
[[nodiscard]] std::vector<float> blurred(const Block& block, const std::vector<float>& values, double sigma_mm,
                                         unsigned threads);

}  // namespace spinaltap::segment
