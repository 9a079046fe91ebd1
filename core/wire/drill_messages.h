// core/wire/drill_messages.h - every message of /ws/drill/{session}. Contract: server/contract/haptics.md (normative),
// golden bytes in server/contract/golden.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/base/result.h"
#include "core/session/session.h"

namespace spinaltap::wire {

inline constexpr std::uint8_t kDrillProtocolVersion = 1;
/// Bounds that keep one message small: a batch of 4096 poses is four seconds at 1 kHz.
inline constexpr std::size_t kMaxPosesPerBatch = 4096;
inline constexpr std::size_t kBytesPerPose = 8 + 6 * 8 + 1;
inline constexpr std::size_t kMaxClientMessageBytes = 8 + kMaxPosesPerBatch * kBytesPerPose;
inline constexpr std::size_t kMaxReasonBytes = 1024, kMaxRecordingIdBytes = 256, kMaxMetricsBytes = 1 << 16;

enum class MessageType : std::uint8_t {
  Hello = 1,
  Poses = 2,
  Finish = 3,
  Welcome = 129,
  Feedback = 130,
  Finished = 131,
  Refused = 132,
};

// Client to server.

struct Hello {
  std::uint32_t max_rate_hz = 0;  ///< of feedback, as the client can take it; 0 when it has no limit
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
  std::uint64_t state_hash = 0;  ///< before the first cycle
  std::uint32_t points_alive = 0;
};
struct Feedback {
  std::uint32_t seq = 0;                         ///< of the last pose of the batch that this answers
  session::Status status = session::Status::Ok;  ///< the largest (worst) of the batch
  std::uint64_t cycle = 0, removed_total = 0;    ///< after the batch
  double thrust_N = 0;                           ///< after the batch; acts on the hand along -axis
  double depth_mm = 0;
  std::uint64_t state_hash = 0;
};
struct Finished {
  std::string recording_id, metrics_json;
};
struct Refused {
  std::string reason;  ///< one line; the connection closes after it
};
using ServerMessage = std::variant<Welcome, Feedback, Finished, Refused>;

/// @pre a batch holds 1 .. kMaxPosesPerBatch poses; texts keep to their bounds (longer ones are cut).
[[nodiscard]] std::vector<std::byte> encode(const ClientMessage& message);
[[nodiscard]] std::vector<std::byte> encode(const ServerMessage& message);

/// Total over any bytes. Poses keep all 64 bits of every number: it is for session::step to refuse what is no pose.
/// @error Corrupt (unknown type, wrong length, reserved bits), Unsupported (another version). The message names the
/// field
///        and is fit for Refused::reason.
[[nodiscard]] Result<ClientMessage> decodeClientMessage(std::span<const std::byte> bytes);
[[nodiscard]] Result<ServerMessage> decodeServerMessage(std::span<const std::byte> bytes);

}  // namespace spinaltap::wire
