// core/segment/edge.h - the wanted vertebra's voxels on the CT's own grid (internal to segment).
// The block decides whose bone it is; where the bone ends is read from the CT as it was scanned, for resampling moves
// and blurs an edge by half a voxel, which costs a tenth of a vertebra's overlap.
#pragma once
#include "core/segment/ownership.h"
#include "core/volume/grid.h"

namespace spinaltap::segment {

struct EdgeInput {
  const volume::CtVolume& ct;
  Vec3 seed_patient;  ///< origin of the block
  const Scene& scene;
  const Spine& spine;
  const Ownership& ownership;
  double threshold_hu;
};

/// Bone that the wanted vertebra owns, its marrow filled, without islands; on the CT's grid. Empty when nothing is
/// left.
[[nodiscard]] volume::LabelVolume drawEdge(const EdgeInput& input);

}  // namespace spinaltap::segment
