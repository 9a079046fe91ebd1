// core/session/session.h - one trainee, one point volume, one bit, live. step() is the only live-loop entry.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/drill/engine.h"
#include "core/drill/sweep.h"
#include "core/haptics/local_model.h"
#include "core/haptics/proxy.h"
#include "core/plan/path.h"
#include "core/point_volume/point_volume.h"
#include "core/session/contact.h"

namespace spinaltap::session {

/// One pose of the hand as it arrived. Any bits are allowed: step() refuses what is not a pose.
struct Input {
  std::uint64_t t_us = 0;  ///< the client's clock; must not fall
  Vec3 tip_mm;             ///< path frame
  Vec3 axis{0, 0, 1};      ///< path frame, shank to tip; normalised by step()
  bool spinning = true;    ///< a bit that does not turn removes nothing
  friend bool operator==(const Input&, const Input&) = default;
};

enum class Status : std::uint8_t {
  Ok = 0,
  RefusedNotFinite = 1,  ///< a component is NaN or infinite, or beyond 1e6 mm
  RefusedAxis = 2,       ///< the axis has no direction (length below 1e-6 or above 1e6)
  RefusedTime = 3,       ///< t_us fell
};

/// A refused input leaves the state untouched, gives no force, and is not counted as a cycle.
struct Output {
  Status status = Status::Ok;
  std::uint64_t cycle = 0;    ///< accepted inputs so far, this one included
  std::uint64_t removed = 0;  ///< points removed by this cycle
  bool behind = false;  ///< rigid: not all of the motion is cut yet; coupled: the hand was too fast. Goes on later
  std::uint64_t removed_total = 0;
  drill::BitPose bit;            ///< where the bit is, which need not be where the hand is
  Vec3 force_N, torque_Nmm;      ///< on the hand, in the tool's frame of `bit` (haptics::Reaction)
  double thrust_N = 0;           ///< -force_N.z; negative where the hole holds a bit that is pulled back
  double depth_mm = 0;           ///< of the bit's tip past the entry point along the path; negative before it
  std::uint64_t state_hash = 0;  ///< of the removed set, the accumulated density, the bit, its forces, and the cycles
};

struct Config {
  plan::Bit bit;
  std::string engine = "clearance";
  double speed_rpm = haptics::kSpeed_rpm;  ///< of a bit that spins; up to 100,000
  /// Between hand and bit. None: the bit is held rigidly, as by a machine that no bone can stop, and stands wherever
  /// the poses say; its force is what the bone would ask of that feed.
  std::optional<haptics::Coupling> coupling = std::nullopt;
};

/// A cycle cuts at no more than so many places (sweep.h): 3.2 mm of motion at a spacing of 0.1 mm. What is left waits
/// for the next. Only while Sweep::kMostPoses poses wait, each of them farther away than that, a cycle goes on until
/// one of them is done.
inline constexpr int kMostCuts = 64;
/// A coupled bit moves in steps of at most a spacing where it may meet bone, and as many a cycle: 1.6 m/s at 0.1 mm and
/// 1 kHz. A hand that is faster is followed in the next cycles.
inline constexpr int kMostSteps = 16;

class Session {
 public:
  /// @error as drill::makeEngine and plan::checkBit; InvalidArgument: speed, stiffness (1e-3 .. 1e6 N/mm) or damping
  ///        (0 .. 1e3 N s/mm) out of range.
  [[nodiscard]] static Result<Session> create(point_volume::PointVolume volume, const Config& config);

  /// Fixed and total: any input gives a defined output. Does not allocate, lock, throw, log or read a clock.
  /// `removed` is handed the indices of the points removed, a few at a time, during the call.
  [[nodiscard]] Output step(const Input& input, drill::RemovedSink removed) noexcept;
  [[nodiscard]] Output step(const Input& input) noexcept {
    return step(input, [](std::span<const std::uint32_t>) {});
  }

  /// What a client needs to feel the bone until the next answer: what the bit would meet where it stands, and ahead.
  /// @cost as a look at the bone (microseconds) for each of haptics::kAhead_mm.
  [[nodiscard]] haptics::LocalModel localModel() const noexcept;

  [[nodiscard]] const point_volume::PointVolume& volume() const { return volume_; }
  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] std::uint64_t stateHash() const;

 private:
  Session(point_volume::PointVolume volume, Config config, std::unique_ptr<drill::Engine> engine);

  /// Moves the bit towards a hand; true when it could not get as far as it would.
  bool holdRigidly(const Input& input, const haptics::Rod& hand, double seconds, drill::RemovedSink removed,
                   drill::Removal& removal);
  bool follow(const Input& input, const haptics::Rod& hand, double seconds, drill::RemovedSink removed,
              drill::Removal& removal);

  point_volume::PointVolume volume_;
  Config config_;
  std::unique_ptr<drill::Engine> engine_;
  drill::Sweep sweep_;
  Contact contact_;
  haptics::Proxy proxy_;
  haptics::Rod hand_;           ///< the last one accepted
  haptics::Reaction reaction_;  ///< of the last cycle
  std::uint64_t cycle_ = 0, last_t_us_ = 0;
  std::uint64_t removed_total_ = 0, density_total_ = 0, removed_hash_ = 0;
};

}  // namespace spinaltap::session
