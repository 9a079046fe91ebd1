// core/wire/drill_messages.h - every message of /ws/drill/{session}. Contract: server/contract/haptics.md (normative),
// golden bytes in server/contract/golden.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "core/haptics/local_model.h"
#include "core/session/session.h"
#include "core/wire/bytes.h"

namespace spinaltap::wire {

inline constexpr std::uint8_t kDrillProtocolVersion = 2;
/// Bounds that keep one message small: a batch of 4096 poses is four seconds at 1 kHz.
inline constexpr std::size_t kMaxPosesPerBatch = 4096;
inline constexpr std::size_t kBytesPerPose = 8 + 6 * 8 + 1;
inline constexpr std::size_t kMaxClientMessageBytes = 8 + kMaxPosesPerBatch * kBytesPerPose;
inline constexpr std::size_t kFeedbackBytes = 264;
inline constexpr std::size_t kMaxReasonBytes = 1024, kMaxRecordingIdBytes = 256, kMaxMetricsBytes = 1 << 16;

enum class MessageType : std::uint8_t {
  Hello = 1,
  Poses = 2,
  Finish = 3,
  Welcome = 129,
  Feedback = 130,
  Finished = 131,
  Refused = 132,
  Status = 133,
};

/// Who knows it may resume the session. A secret: never logged, never shown.
using Token = std::array<std::uint8_t, 16>;

// Client to server.

enum class Role : std::uint8_t { Drive = 0, Watch = 1 };

struct Hello {
  Role role = Role::Drive;
  bool resumes = false;           ///< only who drives
  bool rigid = false;             ///< without a coupling between hand and bit
  std::uint32_t max_rate_hz = 0;  ///< of feedback, as the client can take it; 0 when it has no limit
  // Of the device; 0 where it is not known. Finite, >= 0.
  double max_force_N = 0;
  double max_stiffness_N_mm = 0;
  double damping_N_s_mm = 0;
  std::uint32_t device_rate_hz = 0;
  Token token{};  ///< zeros unless it resumes
  friend bool operator==(const Hello&, const Hello&) = default;
};
struct Poses {
  std::uint32_t first_seq = 0;        ///< of the first pose; the next batch goes on from first_seq + poses.size()
  std::vector<session::Input> poses;  ///< 1 .. kMaxPosesPerBatch, any bits in their numbers
};
struct Finish {};
using ClientMessage = std::variant<Hello, Poses, Finish>;

// Server to client.

struct Welcome {
  bool realtime = false;
  std::uint64_t state_hash = 0;    ///< now
  std::uint32_t points_alive = 0;  ///< before the first pose
  Token token{};                   ///< zeros to those who watch
  std::uint32_t next_seq = 0;      ///< 0 while no pose has come
  double stiffness_N_mm = 0;       ///< of the coupling; 0 when the bit is held rigidly
  double damping_N_s_mm = 0;
  double force_scale = 1;
  std::uint32_t hash_every = 1;  ///< cycles
};
struct Feedback {
  std::uint32_t seq = 0;                         ///< of the last pose answered
  std::uint64_t t_us = 0;                        ///< of that pose
  session::Status status = session::Status::Ok;  ///< the largest (worst) of what is answered
  bool behind = false;
  bool limited = false;                        ///< the force was shortened to the device's maximum
  bool has_hash = false;                       ///< else state_hash is 0 on the wire
  std::uint64_t cycle = 0, removed_total = 0;  ///< after that pose
  Vec3 force_N, torque_Nmm;                    ///< on the hand, tool frame, scaled for the device
  Vec3 force_patient_N;
  Vec3 tip_mm, axis{0, 0, 1};  ///< of the bit, path frame
  double depth_mm = 0;
  double thrust_N = 0;        ///< as the bone gives it: neither scaled nor limited
  haptics::LocalModel local;  ///< its rod is tip_mm and axis, and is not sent twice
  std::uint64_t state_hash = 0;
};
struct Finished {
  std::string recording_id, metrics_json;
};
struct Refused {
  std::string reason;  ///< one line; the connection closes after it
};
enum class StatusCode : std::uint8_t { Paused = 1, Resumed = 2, Overload = 3, WatcherJoined = 4, WatcherLeft = 5 };
struct SessionStatus {
  StatusCode code = StatusCode::Paused;
  std::string text;  ///< one line for people
};
using ServerMessage = std::variant<Welcome, Feedback, Finished, Refused, SessionStatus>;

/// @pre a batch holds 1 .. kMaxPosesPerBatch poses; texts keep to their bounds (longer ones are cut).
[[nodiscard]] std::vector<std::byte> encode(const ClientMessage& message);
[[nodiscard]] std::vector<std::byte> encode(const ServerMessage& message);
/// Appends the same bytes; allocates nothing where the writer has kept its memory.
void encodeFeedback(const Feedback& message, ByteWriter& to);

/// Total over any bytes. Poses keep all 64 bits of every number: it is for session::step to refuse what is no pose.
/// @error Corrupt (unknown type, wrong length, reserved bits), Unsupported (another version). The message names the
/// field
///        and is fit for Refused::reason.
[[nodiscard]] Result<ClientMessage> decodeClientMessage(std::span<const std::byte> bytes);
[[nodiscard]] Result<ServerMessage> decodeServerMessage(std::span<const std::byte> bytes);
/// The same for poses alone, into a batch that keeps its memory.
[[nodiscard]] Result<void> decodePoses(std::span<const std::byte> bytes, Poses& into);

}  // namespace spinaltap::wire
