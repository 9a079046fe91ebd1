// core/segment/profile.h - mean HU along a direction, and the walls and discs that show in it (internal to segment).
// Averaging over a patch at right angles lets a plate or a wall stand out of noise that hides it in single voxels.
#pragma once
#include <vector>

#include "core/segment/block.h"

namespace spinaltap::segment {

/// A rectangle at right angles to a direction: half its sides, and how far its middle lies off along v.
struct Patch {
  Vec3 u, v;
  double half_u, half_v, shift_v;
};

/// Mean HU over a patch at every whole mm from a place, 0 .. farthest_mm + 2; HU bounded, so that gas and calcified
/// spots do not rule. Ends early where the CT does.
[[nodiscard]] std::vector<double> patchProfile(const Block& block, const std::vector<float>& values, const Vec3& from,
                                               const Vec3& out, const Patch& patch, double farthest_mm);

/// A wall of the body, looked for along a direction from a place inside.
struct Face {
  double at_mm = 0;    ///< from that place
  double drop_hu = 0;  ///< how clear it is
};

/// How clear a wall there is at every mm of the way out.
[[nodiscard]] std::vector<double> dropsAlong(const std::vector<double>& profile);

/// The deepest narrow valley before each mm of a profile: how far the HU drop and rise again within 11 mm. Whoever has
/// passed one has passed a disc.
[[nodiscard]] std::vector<double> valleysBefore(const std::vector<double>& profile);

/// The near plate of the first disc on the way out, between two distances; drop_hu is 0 when there is none. Where the
/// CT ends before, its end stands for the plate, with a drop of kCutFace_hu.
/// @param valleys  counts against what lies behind; as long as the profile.
[[nodiscard]] Face firstDisc(const std::vector<double>& profile, const std::vector<double>& valleys, int nearest_mm,
                             int farthest_mm);

inline constexpr double kCutFace_hu = 1;

}  // namespace spinaltap::segment
