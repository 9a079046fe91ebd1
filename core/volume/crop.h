// core/volume/crop.h - the part of a volume that holds one vertebra.
#pragma once
#include <array>

#include "core/volume/grid.h"

namespace spinaltap::volume {

/// Voxels low .. high, both included.
struct VoxelBox {
  std::array<int, 3> low{0, 0, 0}, high{-1, -1, -1};
  friend bool operator==(const VoxelBox&, const VoxelBox&) = default;
};

/// The voxels low .. high (both included); every voxel keeps its place in the patient.
/// @error InvalidArgument when low > high or the box leaves the grid, or the values do not fit the grid.
[[nodiscard]] Result<CtVolume> cropTo(const CtVolume& ct, const std::array<int, 3>& low_voxel,
                                      const std::array<int, 3>& high_voxel);
[[nodiscard]] Result<LabelVolume> cropTo(const LabelVolume& label, const std::array<int, 3>& low_voxel,
                                         const std::array<int, 3>& high_voxel);

/// The smallest box that holds the label. @error NotFound when the label is empty, InvalidArgument when the values do
/// not fit the grid.
[[nodiscard]] Result<VoxelBox> boundsOf(const LabelVolume& label);

/// The box, wider by at least margin_mm on every side, cut at the grid's edge. @pre margin_mm >= 0 and finite.
[[nodiscard]] VoxelBox widened(const VoxelBox& box, const Grid& grid, double margin_mm);

}  // namespace spinaltap::volume
