#include "core/wire/drill_messages.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "core/wire/body.h"

namespace spinaltap::wire {
namespace {

constexpr const char* kWhat = "drill message";
constexpr std::uint8_t kSpinningBit = 1;
constexpr std::uint8_t kResumesBit = 1, kRigidBit = 2;
constexpr std::uint8_t kRealtimeBit = 1;
constexpr std::uint8_t kBehindBit = 1, kLimitedBit = 2, kHashBit = 4;

std::uint8_t bit(bool set, std::uint8_t which) { return set ? which : std::uint8_t{0}; }

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

void writeToken(ByteWriter& out, const Token& token) { out.array<std::uint8_t>(token); }

Token readToken(ByteReader& in) {
  Token token{};
  const std::span<const std::byte> bytes = in.raw(token.size());
  std::transform(bytes.begin(), bytes.end(), token.begin(), [](std::byte v) { return static_cast<std::uint8_t>(v); });
  return token;
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

std::vector<std::byte> encodeHello(const Hello& m) {
  ByteWriter out = open(MessageType::Hello);
  out.u8(static_cast<std::uint8_t>(m.role));
  out.u8(static_cast<std::uint8_t>(bit(m.resumes, kResumesBit) | bit(m.rigid, kRigidBit)));
  out.u32(m.max_rate_hz);
  out.f64(m.max_force_N), out.f64(m.max_stiffness_N_mm), out.f64(m.damping_N_s_mm);
  out.u32(m.device_rate_hz);
  writeToken(out, m.token);
  return out.take();
}

std::vector<std::byte> encodeWelcome(const Welcome& m) {
  ByteWriter out = open(MessageType::Welcome);
  out.u8(bit(m.realtime, kRealtimeBit));
  out.u64(m.state_hash), out.u32(m.points_alive);
  writeToken(out, m.token);
  out.u32(m.next_seq);
  out.f64(m.stiffness_N_mm), out.f64(m.damping_N_s_mm), out.f64(m.force_scale);
  out.u32(m.hash_every);
  return out.take();
}

/// Type and version; the type is checked by the caller.
Result<MessageType> readType(ByteReader& in) {
  const std::uint8_t type = in.u8(), version = in.u8();
  if (in.failed()) return corrupt(kWhat, in.offset(), "ends before its version");
  if (version == 1) {
    return fail(ErrorCode::Unsupported, "drill message: protocol version 1 is no longer spoken, this side speaks 2");
  }
  if (version != kDrillProtocolVersion) {
    return fail(ErrorCode::Unsupported, "drill message: version " + std::to_string(version) + ", this side speaks 2");
  }
  return static_cast<MessageType>(type);
}

bool isBelowZeroOrNoNumber(double v) { return !(v >= 0 && v <= std::numeric_limits<double>::max()); }

/// What is wrong with a hello whose fields are all there; null when nothing is.
const char* faultOf(const Hello& m, std::uint8_t role, std::uint8_t flags) {
  if (role > static_cast<std::uint8_t>(Role::Watch)) return "hello: an unknown role";
  if ((flags & ~(kResumesBit | kRigidBit)) != 0) return "hello: reserved flags";
  if (isBelowZeroOrNoNumber(m.max_force_N)) return "hello: the maximum force is no number from 0 on";
  if (isBelowZeroOrNoNumber(m.max_stiffness_N_mm)) return "hello: the maximum stiffness is no number from 0 on";
  if (isBelowZeroOrNoNumber(m.damping_N_s_mm)) return "hello: the device's damping is no number from 0 on";
  if (m.resumes && m.role == Role::Watch) return "hello: who watches has nothing to resume";
  if (!m.resumes && m.token != Token{}) return "hello: a token that resumes nothing";
  return nullptr;
}

Result<ClientMessage> readHello(ByteReader& in) {
  Hello m;
  const std::uint8_t role = in.u8(), flags = in.u8();
  m.role = static_cast<Role>(role);
  m.resumes = (flags & kResumesBit) != 0, m.rigid = (flags & kRigidBit) != 0;
  m.max_rate_hz = in.u32();
  m.max_force_N = in.f64(), m.max_stiffness_N_mm = in.f64(), m.damping_N_s_mm = in.f64();
  m.device_rate_hz = in.u32();
  m.token = readToken(in);
  if (in.failed()) return corrupt(kWhat, in.offset(), "hello ends early");
  if (const char* fault = faultOf(m, role, flags)) return corrupt(kWhat, in.offset(), fault);
  return m;
}

Result<void> readPosesInto(ByteReader& in, Poses& m) {
  m.poses.clear();
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
  return {};
}

Result<ClientMessage> readPoses(ByteReader& in) {
  Poses m;
  if (auto read = readPosesInto(in, m); !read) return tl::unexpected(read.error());
  return m;
}

Result<ServerMessage> readWelcome(ByteReader& in) {
  Welcome m;
  const std::uint8_t flags = in.u8();
  if ((flags & ~kRealtimeBit) != 0) return corrupt(kWhat, 2, "welcome: reserved flags");
  m.realtime = flags != 0;
  m.state_hash = in.u64(), m.points_alive = in.u32();
  m.token = readToken(in);
  m.next_seq = in.u32();
  m.stiffness_N_mm = in.f64(), m.damping_N_s_mm = in.f64(), m.force_scale = in.f64();
  m.hash_every = in.u32();
  return m;
}

void readLocalModel(ByteReader& in, haptics::LocalModel& local) {
  for (float& v : local.frontal_mm2) v = in.f32();
  local.rubbing_mm2 = in.f32();
  for (float& v : local.side_mm2) v = in.f32();
  for (float& v : local.side_lever) v = in.f32();
}

Result<ServerMessage> readFeedback(ByteReader& in) {
  Feedback m;
  m.seq = in.u32(), m.t_us = in.u64();
  const std::uint8_t status = in.u8(), flags = in.u8();
  m.cycle = in.u64(), m.removed_total = in.u64();
  m.force_N = in.vec3(), m.torque_Nmm = in.vec3(), m.force_patient_N = in.vec3();
  m.tip_mm = in.vec3(), m.axis = in.vec3();
  m.depth_mm = in.f64(), m.thrust_N = in.f64();
  readLocalModel(in, m.local);
  m.local.bit = {m.tip_mm, m.axis};
  m.state_hash = in.u64();
  if (status > static_cast<std::uint8_t>(session::Status::RefusedTime)) return corrupt(kWhat, 14, "unknown status");
  if ((flags & ~(kBehindBit | kLimitedBit | kHashBit)) != 0) return corrupt(kWhat, 15, "feedback: reserved flags");
  m.status = static_cast<session::Status>(status);
  m.behind = (flags & kBehindBit) != 0, m.limited = (flags & kLimitedBit) != 0, m.has_hash = (flags & kHashBit) != 0;
  if (!m.has_hash && m.state_hash != 0) return corrupt(kWhat, 256, "feedback: a hash that its flags deny");
  return m;
}

Result<ServerMessage> readStatus(ByteReader& in) {
  const std::uint8_t code = in.u8();
  if (code < static_cast<std::uint8_t>(StatusCode::Paused) ||
      code > static_cast<std::uint8_t>(StatusCode::WatcherLeft)) {
    return corrupt(kWhat, 2, "status: an unknown code");
  }
  return SessionStatus{static_cast<StatusCode>(code), in.text(kMaxReasonBytes)};
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

void encodeFeedback(const Feedback& m, ByteWriter& to) {
  FixedWriter<kFeedbackBytes> out;
  out.u8(static_cast<std::uint8_t>(MessageType::Feedback)), out.u8(kDrillProtocolVersion);
  out.u32(m.seq), out.u64(m.t_us), out.u8(static_cast<std::uint8_t>(m.status));
  out.u8(
      static_cast<std::uint8_t>(bit(m.behind, kBehindBit) | bit(m.limited, kLimitedBit) | bit(m.has_hash, kHashBit)));
  out.u64(m.cycle), out.u64(m.removed_total);
  out.vec3(m.force_N), out.vec3(m.torque_Nmm), out.vec3(m.force_patient_N);
  out.vec3(m.tip_mm), out.vec3(m.axis);
  out.f64(m.depth_mm), out.f64(m.thrust_N);
  for (const float v : m.local.frontal_mm2) out.f32(v);
  out.f32(m.local.rubbing_mm2);
  for (const float v : m.local.side_mm2) out.f32(v);
  for (const float v : m.local.side_lever) out.f32(v);
  out.u64(m.has_hash ? m.state_hash : 0);
  to.raw(out.bytes());
}

std::vector<std::byte> encode(const ClientMessage& message) {
  return std::visit(
      Overloaded{[](const Hello& m) { return encodeHello(m); }, [](const Poses& m) { return encodePoses(m); },
                 [](const Finish&) { return open(MessageType::Finish).take(); }},
      message);
}

std::vector<std::byte> encode(const ServerMessage& message) {
  return std::visit(Overloaded{[](const Welcome& m) { return encodeWelcome(m); },
                               [](const Feedback& m) {
                                 ByteWriter out;
                                 out.reserve(kFeedbackBytes);
                                 encodeFeedback(m, out);
                                 return out.take();
                               },
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
                               },
                               [](const SessionStatus& m) {
                                 ByteWriter out = open(MessageType::Status);
                                 out.u8(static_cast<std::uint8_t>(m.code));
                                 writeText(out, m.text, kMaxReasonBytes);
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
      return closed<ClientMessage>(in, readHello(in));
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
    case MessageType::Welcome:
      return closed<ServerMessage>(in, readWelcome(in));
    case MessageType::Feedback:
      return closed<ServerMessage>(in, readFeedback(in));
    case MessageType::Finished: {
      std::string id = in.text(kMaxRecordingIdBytes);
      std::string metrics = in.text(kMaxMetricsBytes);
      return closed<ServerMessage>(in, Finished{std::move(id), std::move(metrics)});
    }
    case MessageType::Refused:
      return closed<ServerMessage>(in, Refused{in.text(kMaxReasonBytes)});
    case MessageType::Status:
      return closed<ServerMessage>(in, readStatus(in));
    default:
      return unknownType(*type);
  }
}

Result<void> decodePoses(std::span<const std::byte> bytes, Poses& into) {
  ByteReader in(bytes);
  const Result<MessageType> type = readType(in);
  if (!type) return tl::unexpected(type.error());
  if (*type != MessageType::Poses) return unknownType(*type);
  return readPosesInto(in, into);  // which looks at the length
}

}  // namespace spinaltap::wire
