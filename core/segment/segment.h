// core/segment/segment.h - the voxels that belong to one vertebra.
#pragma once
#include <cstdint>
#include <span>

#include "core/base/result.h"
#include "core/volume/grid.h"

namespace spinaltap::segment {

struct GrowOptions {
  Vec3 seed_patient;          ///< in or beside the bone, e.g. in the middle of the vertebral body
  double threshold_hu = 150;  ///< bone is at or above it
  /// Growth stays within this distance of the seed along each patient axis (x left-right, y front-back, z feet-head),
  /// so that one vertebra can be taken out of a whole spine. Infinite by default.
  Vec3 half_box_mm{kNoLimit, kNoLimit, kNoLimit};
  /// The box's centre relative to the seed: a seed in the body lies some 25 mm in front of the vertebra's middle.
  Vec3 box_offset_mm;
  /// Bridges narrower than twice this (worn facet joints, bits of a neighbour) are cut. 0 keeps them.
  double neck_mm = 0;
  /// Gaps up to twice this in the cortical shell are bridged while the marrow is filled. The canal and the foramina
  /// are wider and open at both ends, so they stay open.
  double closing_mm = 1.5;
  /// The nearest bone within this of the seed is taken, so that a seed in marrow darker than the threshold finds its
  /// shell.
  double seed_reach_mm = 15;
  double max_volume_mm3 = 250'000;  ///< an L3 has some 60,000 to 90,000; more means that growth leaked

  static constexpr double kNoLimit = 1e300;
};

/// Threshold, 3-D region growing from the seed (6 neighbours), then the marrow is filled. The result has the CT's grid.
/// @error InvalidArgument (seed outside the volume, options out of range), NotFinite, NotFound (no bone at the seed:
/// the
///        message names the HU there), Limit (the region outgrew max_volume_mm3).
/// @cost  linear in the voxels of the box; a few passes.
[[nodiscard]] Result<volume::LabelVolume> growFromSeed(const volume::CtVolume& ct, const GrowOptions& options);

/// The voxels of `values` (laid out as the grid is) that equal `wanted_value`.
/// @error InvalidArgument (sizes differ), NotFound (the message lists the values that are present).
[[nodiscard]] Result<volume::LabelVolume> keepLabel(const volume::Grid& grid, std::span<const std::int32_t> values,
                                                    std::int32_t wanted_value);

/// The largest 6-connected part of a label: specks that an imported mask may hold would each become a surface.
/// @error NotFound when the label is empty.
[[nodiscard]] Result<volume::LabelVolume> largestIsland(const volume::LabelVolume& label);

}  // namespace spinaltap::segment
