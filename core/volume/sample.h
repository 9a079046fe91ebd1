// core/volume/sample.h - HU between the voxels.
#pragma once
#include <span>

#include "core/volume/grid.h"

namespace spinaltap::volume {

/// Trilinear HU at a point; outside the grid the value of the nearest edge voxel.
/// Only + - * / are used, so the value has the same bits on every target.
/// @pre ct has at least one voxel; the point is finite.
[[nodiscard]] double sampleHu(const CtVolume& ct, const Vec3& patient);

/// The same at continuous voxel coordinates (voxel centres are integers).
[[nodiscard]] double sampleHuAtVoxel(const CtVolume& ct, const Vec3& voxel);

/// The same for any values laid out as the grid is. @pre values.size() == grid.voxels() > 0.
[[nodiscard]] double sampleAtVoxel(const Grid& grid, std::span<const float> values, const Vec3& voxel);

}  // namespace spinaltap::volume
