// core/recording/player.h - a recording to look at: any cycle, in any order.
#pragma once
#include <cstdint>
#include <vector>

#include "core/recording/recording.h"

namespace spinaltap::recording {

/// The session after one accepted input.
struct Moment {
  session::Input input;
  double thrust_N = 0, depth_mm = 0;
  std::uint64_t removed_total = 0;
};

/// Replays once, keeping which points went in which cycle; after that any cycle costs only the points between.
/// Memory: 4 bytes a removed point and about 100 bytes a cycle.
class Player {
 public:
  /// Recordings of the engine `reference` are run with `clearance`, which removes the same points and is some hundred
  /// times faster; that the hashes then agree is still proof. @error as replay.
  [[nodiscard]] static Result<Player> create(Recording recording);

  [[nodiscard]] const Header& header() const { return recording_.header; }
  [[nodiscard]] bool complete() const { return recording_.complete; }
  [[nodiscard]] const ReplayReport& report() const { return report_; }
  /// Accepted inputs. Cycle 0 is before the first.
  [[nodiscard]] std::uint64_t cycles() const { return moments_.size(); }
  /// @pre 1 <= cycle <= cycles().
  [[nodiscard]] const Moment& moment(std::uint64_t cycle) const { return moments_[cycle - 1]; }

  /// Beyond the end is the end. @cost O(points removed between the two cycles).
  void seek(std::uint64_t cycle);
  [[nodiscard]] std::uint64_t cycle() const { return cycle_; }
  /// As it is at cycle().
  [[nodiscard]] const point_volume::PointVolume& volume() const { return volume_; }
  /// As it was at cycle 0.
  [[nodiscard]] const point_volume::PointVolume& before() const { return recording_.volume; }

 private:
  Player() = default;

  Recording recording_;
  ReplayReport report_;
  std::vector<Moment> moments_;
  std::vector<std::uint32_t> removed_;  ///< cycle after cycle: those of cycle c end at moment(c).removed_total
  point_volume::PointVolume volume_;
  std::uint64_t cycle_ = 0;
};

}  // namespace spinaltap::recording
