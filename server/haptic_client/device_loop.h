// server/haptic_client/device_loop.h - one tick of a device: hand in, what the server answered, force out, pose to the
// server. Knows no thread, clock or socket: time is handed in, and a Link carries. A device that calls back at its own
// rate may own one of these instead of being a Device of a Client.
//
// When answers stay away, nothing that is felt is true any more, so the drill is let go: what the hand does then is not
// sent, and the force fades. So it is when the loop itself slept for longer than haptics::kPause_s. Once the server
// answers again, the drill is taken up where its bit stands: the hand's position is shifted and turned so that the
// spring between them is at rest. So a stall neither kicks the hand nor cuts bone that nobody felt, and every pose that
// was sent is drilled.
#pragma once
#include <array>
#include <functional>

#include "core/haptics/port.h"
#include "core/wire/drill_messages.h"
#include "server/haptic_client/device.h"

namespace spinaltap::haptic_client {

/// An answer of the server, and how long it took from the pose on, us.
struct Answer {
  wire::Feedback feedback;
  std::uint32_t round_trip_us = 0;
};

/// To the server and back; called from the device loop's thread, and never waits.
class Link {
 public:
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;
  virtual void send(std::uint32_t seq, const session::Input& pose) = 0;
  /// The next answer; false when there is none.
  virtual bool take(Answer& into) = 0;
  /// How often the line broke and was resumed.
  [[nodiscard]] virtual std::uint32_t resumed() const = 0;
};

struct LoopSetup {
  haptics::Coupling coupling;  ///< as the server's welcome says
  haptics::Drive drive;
  haptics::PortLimits limits;
  double let_go_after_s = 0.25;  ///< without an answer to what was sent
};
/// What the server is told of a device.
[[nodiscard]] wire::Hello helloFrom(const DeviceTraits& traits);
/// Coupling, scale and limits from what the server and the device said. @pre welcome.stiffness_N_mm > 0.
[[nodiscard]] LoopSetup setupFrom(const wire::Welcome& welcome, const DeviceTraits& traits, double bit_diameter_mm);

enum class Phase : std::uint8_t { Greeting, Holding, LetGo };

/// What a tick did.
struct Tick {
  std::uint64_t t_us = 0;
  Phase phase = Phase::Greeting;
  haptics::Rod hand;          ///< as the server sees it, path frame
  haptics::Port::Felt felt;   ///< that the device pushes with
  std::uint32_t sent = 0;     ///< poses so far
  bool all_answered = false;  ///< of them
};
/// An answer beside the tick whose pose it answers.
struct Answered {
  const Answer& answer;
  const Tick& tick;
  double force_scale;
};

class DeviceLoop {
 public:
  static constexpr double kFade_s = 0.05;
  /// Poses without an answer; more are not remembered by haptics::LocalBit, so the drill is let go.
  static constexpr std::uint32_t kMostUnanswered = haptics::LocalBit::kMostRemembered - 1;

  using OnAnswer = std::function<void(const Answered&)>;
  DeviceLoop(Device& device, Link& link, const LoopSetup& setup, OnAnswer on_answer = {});

  /// @param t_us since the loop began; must rise. @error as the device says; the device was told to push nothing.
  [[nodiscard]] Result<Tick> tick(std::uint64_t t_us);

  /// Takes what the server answered since; tick() does it, and who ends a loop may do it once more.
  void listen();

  [[nodiscard]] const haptics::PassivityGuard& guard() const { return port_.guard(); }
  /// Of the bit, as answered last.
  [[nodiscard]] double depth_mm() const { return last_.depth_mm; }
  [[nodiscard]] std::uint64_t timesLetGo() const { return let_go_; }
  /// From the hand's position to the server's, that taking up the drill again added.
  [[nodiscard]] const Vec3& shift_mm() const { return shift_mm_; }

 private:
  void greet(const HandPose& pose);
  void hold(const HandPose& pose, double seconds);
  void fade(const HandPose& pose, double seconds);
  void takeUp(const HandPose& pose);
  void letGo();
  void send(const haptics::Rod& hand, bool spinning);
  [[nodiscard]] haptics::Rod seen(const HandPose& pose) const;
  [[nodiscard]] bool isStale() const;
  [[nodiscard]] bool allAnswered() const { return sent_ > 0 && answered_ == sent_; }

  Device& device_;
  Link& link_;
  LoopSetup setup_;
  OnAnswer on_answer_;
  haptics::Port port_;
  Tick now_;
  std::uint64_t t_us_ = 0;
  double seconds_ = 0;                                           ///< since the tick before
  std::uint32_t sent_ = 0, answered_ = 0;                        ///< poses; their numbers begin with 0
  std::array<Tick, haptics::LocalBit::kMostRemembered> past_{};  ///< by number
  wire::Feedback last_;                                          ///< the newest answer
  bool asked_ = false;                                           ///< let go: where the bit is, with a pose of its own
  std::uint32_t resumed_ = 0, resumed_at_ = 0;                   ///< as told; how many were sent then
  Vec3 bone_N_, bone_Nmm_;                                       ///< asked for last, path frame
  double faded_ = 0;                                             ///< 1: all is gone
  Vec3 shift_mm_;
  Mat3 turn_;
  std::uint64_t let_go_ = 0;
};

}  // namespace spinaltap::haptic_client
