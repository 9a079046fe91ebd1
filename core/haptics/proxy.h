// core/haptics/proxy.h - the bit that stands where bone and spin let it, while a hand pulls at it through springs.
//
// The proxy is a rod without mass: its tip follows the hand's tip through a spring of three directions, and its grip,
// kGrip_mm up the shank, the hand's grip through one across the axis. In a step of T seconds each end moves so that
// spring and damper balance what the bone asks for at the velocity of that very step:
//
//   K (hand - proxy - v T) + B (hand's velocity - v) = resistance(v)
//
// which is implicit in v and has one solution, since resistance only grows with v. So no stiffness, damping or step
// makes the bit swing: whatever energy the springs hold is spent on bone or given back to the hand, never made.
// Along the axis that is one equation. Across it, tip and grip share the sides' contacts: four unknowns, which make a
// convex potential least (after J. J. Moreau, "Sur les lois de frottement, de plasticite et de viscosite", C. R. Acad.
// Sci. 271, 1970); Newton's method with a line search. The answer is always what the sides say at the velocity found,
// and they only ever push back, so even a search that ended early would make no energy.
//
// A god-object (C. B. Zilles and J. K. Salisbury, IROS 1995) that may cut; coupling after J. E. Colgate et al., IROS
// 1995. haptics knows no bone: what the bit meets comes as areas weighted with hardness (cutting.h).
#pragma once
#include <array>
#include <cstddef>

#include "core/base/vec3.h"
#include "core/haptics/cutting.h"

namespace spinaltap::haptics {

struct Coupling {
  double stiffness_N_mm = kStiffness_N_mm;  ///< K of each spring
  double damping_N_s_mm = 0;                ///< B, beside it
  friend bool operator==(const Coupling&, const Coupling&) = default;
};

/// The stiffest coupling that a device can hold: b > K T / 2 + |B| (J. E. Colgate and G. G. Schenkel, J. Robotic Syst.
/// 14, 1997), solved for K; 0 when the damping alone is too much.
/// @param device_damping_N_s_mm b: of the device itself; period_s T: of its loop.
[[nodiscard]] double stiffestCoupling_N_mm(double device_damping_N_s_mm, double period_s, double damping_N_s_mm);
/// The stiffness to use: as wanted, or kCouplingMargin of the stiffest where that is less.
[[nodiscard]] double boundedStiffness_N_mm(double wanted_N_mm, double device_damping_N_s_mm, double period_s,
                                           double damping_N_s_mm);

/// Across the axis, some of the bit's side that meets bone.
struct SideContact {
  double x = 0, y = 0;  ///< unit normal, outward, in the tool's frame (z along the axis)
  double lever = 0;     ///< 0 at the tip, 1 at the grip
  double area_mm2 = 0;  ///< projected onto the normal, weighted with hardness
};
inline constexpr std::size_t kMostSides = 32;

/// What the bit would meet if it moved on.
struct Meeting {
  double frontal_mm2 = 0;  ///< of the tip, projected onto a plane across the axis, weighted with hardness
  double rubbing_mm2 = 0;  ///< of the shaft, weighted with hardness
  std::array<SideContact, kMostSides> sides{};
  std::size_t side_count = 0;
};

/// A rod in the path frame: the tip, and the unit vector from the grip to it.
struct Rod {
  Vec3 tip_mm;
  Vec3 axis{0, 0, 1};
  [[nodiscard]] Vec3 grip_mm() const { return tip_mm - axis * kGrip_mm; }
};

/// What the bone answers, acting on the hand. Tool frame: z along the rod's axis, x and y as toolX(), toolY().
struct Reaction {
  Vec3 force_N;          ///< z is minus the thrust
  Vec3 torque_Nmm;       ///< about the tip; z is minus the cutting torque
  double feed_mm_s = 0;  ///< along the axis
  double done = 1;       ///< the part of the step that was done; less where the way was longer than one step may be
};

/// Two unit vectors across the axis, turning with it by the shortest way from the path's x and y.
[[nodiscard]] Vec3 toolX(const Vec3& axis);
[[nodiscard]] Vec3 toolY(const Vec3& axis);
[[nodiscard]] inline Vec3 fromTool(const Vec3& axis, const Vec3& v) {
  return toolX(axis) * v.x + toolY(axis) * v.y + axis * v.z;
}

struct Step {
  double seconds = 0;  ///< T, > 0
  bool spinning = true;
  double longest_mm = 0;  ///< no point of the rod within `reach_mm` of the tip moves farther
  double reach_mm = 0;
};

class Proxy {
 public:
  Proxy(const Coupling& coupling, const Drive& drive) : coupling_(coupling), drive_(drive) {}

  /// Where the rod begins; forgets all that was.
  void place(const Rod& rod);
  /// Moves the rod rigidly to a hand that no bone can stop; the answer is what bone asks of that feed along the axis.
  Reaction carry(const Rod& hand, const Meeting& meeting, double feed_mm_s, bool spinning);
  /// Stays, held by something that gives way to nothing; the answer is all that the springs pull.
  [[nodiscard]] Reaction stand(const Rod& before, const Rod& hand, double seconds) const;
  /// One step towards a hand that moved from `before` to `hand` within it. + - * / and sqrt only.
  /// @pre finite, axes unit vectors; step.seconds > 0.
  Reaction step(const Rod& before, const Rod& hand, const Meeting& meeting, const Step& step);

  [[nodiscard]] const Rod& rod() const { return rod_; }
  [[nodiscard]] const Coupling& coupling() const { return coupling_; }
  [[nodiscard]] const Drive& drive() const { return drive_; }

 private:
  /// What the springs pull with at the tip and at the grip, path frame.
  struct Pull {
    Vec3 tip_N, grip_N;
  };
  [[nodiscard]] Pull pull(const Rod& before, const Rod& hand, double seconds) const;
  Reaction stepFree(const Rod& hand, const Step& step);
  Reaction stepInBone(const Rod& before, const Rod& hand, const Meeting& meeting, const Step& step);

  Coupling coupling_;
  Drive drive_;
  Rod rod_;
};

}  // namespace spinaltap::haptics
