// core/phantom/anatomy.h - the dimensions of one L3, and its implicit function in its own frame.
// Local frame: origin at the middle of the vertebral body, x to the patient's left, y to the back, z to the head, mm.
#pragma once
#include <cstdint>

#include "core/base/vec3.h"

namespace spinaltap::phantom {

/// Dimensions in mm and radians. The defaults are a middling adult L3; make() varies them.
struct Anatomy {
  double rim_half_width = 24.3, waist_half_width = 20.5;  ///< body, side to side
  double rim_half_depth = 17.0, waist_half_depth = 15.6;  ///< body, front to back
  double half_height = 14.3;                              ///< body, at the rims
  double wedge = 0.025;                                   ///< front minus back height, per mm of depth and endplate
  double endplate_dish = 2.2;                             ///< depth of the endplates' concavity
  double kidney = 0.0140;                                 ///< how far the section is bent backwards, per mm^2 of x
  double pedicle_half_width = 4.6, pedicle_half_height = 6.8;
  double pedicle_angle = 0.21;  ///< medially towards the front, in the transverse plane
  double canal_half_width = 11.4, canal_apex_y = 33.0;
  double transverse_span = 46.0;  ///< midline to tip
  double spinous_tip_y = 66.0;
  double articular_scale = 1.0;               ///< of the four articular processes
  double warp_phase[6] = {0, 0, 0, 0, 0, 0};  ///< of the slight irregularity that makes the sides differ

  [[nodiscard]] static Anatomy make(std::uint64_t seed);
};

/// mm, negative inside bone.
[[nodiscard]] double boneDistance(const Anatomy& anatomy, const Vec3& local);
/// The same with every part evaluated: the slow twin, for tests.
[[nodiscard]] double boneDistanceUnskipped(const Anatomy& anatomy, const Vec3& local);

/// Which tissue stands where, for the HU. Both are distances like boneDistance.
[[nodiscard]] double bodyDistance(const Anatomy& anatomy, const Vec3& local);
/// Across the body's axis only: the body's column, continued into the discs.
[[nodiscard]] double bodyOutline(const Anatomy& anatomy, const Vec3& local);
[[nodiscard]] double canalDistance(const Anatomy& anatomy, const Vec3& local);

/// The middle of the left (side = 1) or right (-1) pedicle's isthmus, and the unit axis towards the front.
[[nodiscard]] Vec3 pedicleIsthmus(const Anatomy& anatomy, double side);
[[nodiscard]] Vec3 pedicleAxis(const Anatomy& anatomy, double side);

}  // namespace spinaltap::phantom
