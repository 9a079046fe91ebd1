#include "core/wire/drill_messages.h"

#include <algorithm>
#include <cassert>

#include "core/wire/body.h"

namespace spinaltap::wire {
namespace {

constexpr const char* kWhat = "drill message";
constexpr std::uint8_t kSpinningBit = 1;

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

ByteWriter open(MessageType type) {
  ByteWriter out;
  out.u8(static_cast<std::uint8_t>(type)), out.u8(kDrillProtocolVersion);
  return out;
}

void writeText(ByteWriter& out, std::string_view text, std::size_t limit) { out.text(text.substr(0, limit)); }

std::vector<std::byte> encodePoses(const Poses& m) {
  assert(!m.poses.empty() && m.poses.size() <= kMaxPosesPerBatch);
  ByteWriter out = open(MessageType::Poses);
  out.reserve(8 + m.poses.size() * kBytesPerPose);
  out.u32(m.first_seq), out.u16(static_cast<std::uint16_t>(m.poses.size()));
  for (const session::Input& pose : m.poses) {
    out.u64(pose.t_us), out.vec3(pose.tip_mm), out.vec3(pose.axis), out.u8(pose.spinning ? kSpinningBit : 0);
  }
  return out.take();
}

std::vector<std::byte> encodeFeedback(const Feedback& m) {
  ByteWriter out = open(MessageType::Feedback);
  out.u32(m.seq), out.u8(static_cast<std::uint8_t>(m.status));
  out.u64(m.cycle), out.u64(m.removed_total);
  out.f64(m.thrust_N), out.f64(m.depth_mm), out.u64(m.state_hash);
  return out.take();
}

/// Type and version; the type is checked by the caller.
Result<MessageType> readType(ByteReader& in) {
  const std::uint8_t type = in.u8(), version = in.u8();
  if (in.failed()) return corrupt(kWhat, in.offset(), "ends before its version");
  if (version != kDrillProtocolVersion) {
    return fail(ErrorCode::Unsupported, "drill message: version " + std::to_string(version) + ", this side speaks 1");
  }
  return static_cast<MessageType>(type);
}

Result<ClientMessage> readPoses(ByteReader& in) {
  Poses m;
  m.first_seq = in.u32();
  const std::size_t count = in.u16();
  if (in.failed()) return corrupt(kWhat, in.offset(), "poses end before their count");
  if (count == 0 || count > kMaxPosesPerBatch) {
    return corrupt(kWhat, 6, "a batch of " + std::to_string(count) + " poses");
  }
  if (in.left() != count * kBytesPerPose) return corrupt(kWhat, 6, "a pose count that does not fit the length");
  m.poses.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    session::Input pose;
    pose.t_us = in.u64(), pose.tip_mm = in.vec3(), pose.axis = in.vec3();
    const std::uint8_t flags = in.u8();
    if ((flags & ~kSpinningBit) != 0) return corrupt(kWhat, in.offset() - 1, "reserved flags");
    pose.spinning = flags != 0;
    m.poses.push_back(pose);
  }
  return m;
}

Result<ServerMessage> readFeedback(ByteReader& in) {
  Feedback m;
  m.seq = in.u32();
  const std::uint8_t status = in.u8();
  m.cycle = in.u64(), m.removed_total = in.u64();
  m.thrust_N = in.f64(), m.depth_mm = in.f64(), m.state_hash = in.u64();
  if (status > static_cast<std::uint8_t>(session::Status::RefusedTime)) return corrupt(kWhat, 6, "unknown status");
  m.status = static_cast<session::Status>(status);
  return m;
}

template <class Message>
Result<Message> closed(const ByteReader& in, Result<Message> message) {
  if (!message) return message;
  if (auto ok = checkEnd(in, kWhat); !ok) return tl::unexpected(ok.error());
  return message;
}

tl::unexpected<Error> unknownType(MessageType type) {
  return corrupt(kWhat, 0, "unknown type " + std::to_string(static_cast<int>(type)));
}

}  // namespace

std::vector<std::byte> encode(const ClientMessage& message) {
  return std::visit(Overloaded{[](const Hello& m) {
                                 ByteWriter out = open(MessageType::Hello);
                                 out.u32(m.max_rate_hz);
                                 return out.take();
                               },
                               [](const Poses& m) { return encodePoses(m); },
                               [](const Finish&) { return open(MessageType::Finish).take(); }},
                    message);
}

std::vector<std::byte> encode(const ServerMessage& message) {
  return std::visit(Overloaded{[](const Welcome& m) {
                                 ByteWriter out = open(MessageType::Welcome);
                                 out.u64(m.state_hash), out.u32(m.points_alive);
                                 return out.take();
                               },
                               [](const Feedback& m) { return encodeFeedback(m); },
                               [](const Finished& m) {
                                 ByteWriter out = open(MessageType::Finished);
                                 writeText(out, m.recording_id, kMaxRecordingIdBytes);
                                 writeText(out, m.metrics_json, kMaxMetricsBytes);
                                 return out.take();
                               },
                               [](const Refused& m) {
                                 ByteWriter out = open(MessageType::Refused);
                                 writeText(out, m.reason, kMaxReasonBytes);
                                 return out.take();
                               }},
                    message);
}

Result<ClientMessage> decodeClientMessage(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  const Result<MessageType> type = readType(in);
  if (!type) return tl::unexpected(type.error());
  switch (*type) {
    case MessageType::Hello:
      return closed<ClientMessage>(in, Hello{in.u32()});
    case MessageType::Poses:
      return closed<ClientMessage>(in, readPoses(in));
    case MessageType::Finish:
      return closed<ClientMessage>(in, Finish{});
    default:
      return unknownType(*type);
  }
}

Result<ServerMessage> decodeServerMessage(std::span<const std::byte> bytes) {
  ByteReader in(bytes);
  const Result<MessageType> type = readType(in);
  if (!type) return tl::unexpected(type.error());
  switch (*type) {
    case MessageType::Welcome: {
      const std::uint64_t hash = in.u64();
      return closed<ServerMessage>(in, Welcome{hash, in.u32()});
    }
    case MessageType::Feedback:
      return closed<ServerMessage>(in, readFeedback(in));
    case MessageType::Finished: {
      std::string id = in.text(kMaxRecordingIdBytes);
      std::string metrics = in.text(kMaxMetricsBytes);
      return closed<ServerMessage>(in, Finished{std::move(id), std::move(metrics)});
    }
    case MessageType::Refused:
      return closed<ServerMessage>(in, Refused{in.text(kMaxReasonBytes)});
    default:
      return unknownType(*type);
  }
}

}  // namespace spinaltap::wire
