// core/segment/flood.h - connected voxels and enclosed ones (internal to segment).
#pragma once
#include <cstddef>
#include <vector>

#include "core/segment/distance.h"

namespace spinaltap::segment {

/// Unsets and returns the voxels joined to `start` through faces, over set voxels. @pre start is set.
/// Stops early, with more than `most` voxels, when the part is larger.
[[nodiscard]] std::vector<std::size_t> takeConnected(Mask& mask, std::size_t start, std::size_t most);

/// Sets every unset voxel that no path through faces over unset voxels joins to the block's border.
/// This is a 3-D fill: a canal that is open at its ends stays open, though each transaxial slice closes it.
void fillHoles(Mask& mask);

}  // namespace spinaltap::segment
