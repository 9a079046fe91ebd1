// core/drill/sweep.h - the poses between two poses, so that a fast bit leaves nothing standing that it went through.
#pragma once
#include <array>
#include <cstddef>
#include <optional>

#include "core/drill/engine.h"

namespace spinaltap::drill {

/// Turns the bit's motion from pose to pose into cuts so close together that no point of the bit moves farther than
/// 2 * kSurvival spacings from one to the next. A point that the bit went through then lies, at the nearer of two cuts,
/// at most kSurvival spacings outside the bit: nothing survives that was ever deeper inside.
/// Between poses the tip moves straight and the axis turns on the shortest arc, its end along the chord (in two halves,
/// any way round, if they are opposite). Where the bit is too far away to touch the lattice, nothing is cut.
///
/// A pose takes as many cuts as the motion needs. Who has only so much time takes fewer, and the rest the next time.
class Sweep {
 public:
  static constexpr double kSurvival = 0.25;      ///< of a spacing
  static constexpr std::size_t kMostPoses = 46;  ///< the longest way through a lattice takes so many cycles at 0.1 mm

  /// @pre both are valid.
  Sweep(const point_volume::Lattice& lattice, const plan::Bit& bit);

  /// False, and nothing else happens, when kMostPoses poses are waiting. The first pose is cut where it is; so is one
  /// after a pose that was not cutting, since the bit came there without turning.
  /// @pre the pose is finite, its axis a unit vector.
  [[nodiscard]] bool add(const BitPose& pose, bool cutting);

  /// The next pose to cut at, in order; none when all are done.
  [[nodiscard]] std::optional<BitPose> next();

  [[nodiscard]] bool done() const { return count_ == 0; }

 private:
  struct Target {
    BitPose pose;
    bool cutting = false;
  };
  /// How far any point of the bit moves, at most.
  [[nodiscard]] double motion_mm(const BitPose& from, const BitPose& to) const;
  /// A part of the way from here_ to `to`.
  [[nodiscard]] BitPose poseAt(const BitPose& to, double part) const;
  /// The part of the way after which the next cut comes; 1 when none comes before the end.
  [[nodiscard]] double nextPart(const BitPose& to) const;
  /// The part at which a tip that moves on from `part` comes near enough; 1 when it does not.
  [[nodiscard]] double partOfReach(const BitPose& to, double part) const;

  double longest_mm_, reach_mm_;  ///< of a cut's motion; of the bit from its tip
  Vec3 middle_mm_;
  double near_mm_;              ///< a tip farther from the middle than that: the bit can't touch the lattice
  std::optional<Target> here_;  ///< the last one reached
  double part_ = 0;             ///< of the way from there to the first one that waits
  std::array<Target, kMostPoses> waiting_;
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace spinaltap::drill
