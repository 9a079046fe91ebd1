// core/recording/player.h - a recording to look at: any cycle, in any order.
#pragma once
#include <cstdint>
#include <vector>

#include "core/recording/recording.h"

namespace spinaltap::recording {

/// The session after one accepted input.
struct Moment {
  session::Input input;  ///< of the hand
  drill::BitPose bit;    ///< where the bit was
  double thrust_N = 0, depth_mm = 0;
  std::uint64_t removed_total = 0;
};

/// Replays once, keeping which points went in which cycle, and the whole volume now and then (keyframes); after that
/// any cycle costs a keyframe's copy and the points between, and only the latter when it is near. Memory: 76 bytes a
/// cycle (124 where the bit was coupled to the hand and not held rigidly), 4 a removed point, and 6.3 a point of the
/// volume (two copies with densities, keyframes).
class Player {
 public:
  /// Recordings of the engine `reference` are run with `clearance`, which removes the same points and is some hundred
  /// times faster; that the hashes then agree is still proof. @error as replay.
  [[nodiscard]] static Result<Player> create(Recording recording);

  [[nodiscard]] const Header& header() const { return recording_.header; }
  [[nodiscard]] bool complete() const { return recording_.complete; }
  [[nodiscard]] const ReplayReport& report() const { return report_; }
  /// Accepted inputs. Cycle 0 is before the first.
  [[nodiscard]] std::uint64_t cycles() const { return thrust_N_.size(); }
  /// @pre 1 <= cycle <= cycles(). @cost O(log(refused inputs)).
  [[nodiscard]] Moment moment(std::uint64_t cycle) const;

  /// Beyond the end is the end. @cost O(points of the volume / kKeyframes), and a copy of the alive bits.
  void seek(std::uint64_t cycle);
  [[nodiscard]] std::uint64_t cycle() const { return cycle_; }
  /// As it is at cycle().
  [[nodiscard]] const point_volume::PointVolume& volume() const { return volume_; }
  /// As it was at cycle 0.
  [[nodiscard]] const point_volume::PointVolume& before() const { return recording_.volume; }
  /// What it holds.
  [[nodiscard]] std::size_t bytes() const;

  static constexpr std::uint64_t kKeyframes = 16;  ///< when every point of the volume goes

 private:
  Player() = default;
  /// Points removed up to and with a cycle.
  [[nodiscard]] std::uint64_t goneAt(std::uint64_t cycle) const { return cycle == 0 ? 0 : gone_[cycle - 1]; }
  void makeKeyframes();

  Recording recording_;
  ReplayReport report_;
  std::vector<double> thrust_N_;                       ///< after each cycle
  std::vector<drill::BitPose> bits_;                   ///< likewise; none when held rigidly, where the hand is
  std::vector<std::uint32_t> gone_;                    ///< points removed up to each cycle
  std::vector<std::uint64_t> refused_;                 ///< for each refused input, the cycles before it
  std::vector<std::uint32_t> removed_;                 ///< cycle after cycle
  std::uint64_t apart_ = 1;                            ///< removed points from one keyframe to the next
  std::vector<std::vector<std::uint64_t>> keyframes_;  ///< alive bits when the i+1-th multiple of apart_ was removed
  point_volume::PointVolume volume_;
  std::uint64_t cycle_ = 0;
};

}  // namespace spinaltap::recording
