// core/segment/ownership.h - which bone belongs to which vertebra (internal to segment).
#pragma once
#include <vector>

#include "core/segment/compete.h"
#include "core/segment/neighbours.h"

namespace spinaltap::segment {

struct Spine {
  Body wanted;
  Rival above, below;
};

inline constexpr std::uint8_t kWanted = 0, kAbove = 1, kBelow = 2, kOther = 3;  // kOther: ribs, ilium

struct Ownership {
  std::vector<std::uint8_t> owner;  ///< #voxels of the block: kWanted, kAbove, kBelow, kOther or kNobody
};

/// Seeds each vertebra's body, pedicles and lamina, and lets them flood the bone against each other. Dark voxels cost
/// more than bright ones, valleys (joint spaces) most.
/// @param threshold_hu  bone is brighter.
[[nodiscard]] Ownership shareBone(const Scene& scene, const Spine& spine, double threshold_hu);

}  // namespace spinaltap::segment
