#include "server/haptic_client/line.h"

#include <sys/socket.h>

#include <cerrno>
#include <utility>

#include "server/haptic_client/rest.h"

namespace spinaltap::haptic_client {

Result<Line> Line::open(const Address& server, const std::string& session, const wire::Hello& hello,
                        std::chrono::milliseconds patience) {
  auto socket = openWebSocket(server, session, patience);
  if (!socket) return tl::unexpected(socket.error());
  Line line(std::move(*socket));
  if (auto greeted = line.greet(hello); !greeted) return tl::unexpected(std::move(greeted.error()));
  return line;
}

/// Waits, as no other of these does. What comes behind the welcome stays in the reader.
Result<void> Line::greet(const wire::Hello& hello) {
  wire::ByteWriter out;
  ws::writeFrame(out, ws::Opcode::Binary, wire::encode(wire::ClientMessage(hello)), ws::Side::Client);
  if (!sendAll(handle(), {reinterpret_cast<const char*>(out.bytes().data()), out.bytes().size()})) {
    return fail(ErrorCode::Io, "the server ended the line before it was greeted");
  }
  for (;;) {
    const auto bytes = nextMessage();
    if (!bytes) return tl::unexpected(bytes.error());
    auto message = wire::decodeServerMessage(*bytes);
    if (!message) return fail(ErrorCode::Corrupt, "the server's welcome: " + message.error().message);
    if (std::holds_alternative<wire::SessionStatus>(*message)) continue;
    if (const auto* refused = std::get_if<wire::Refused>(&*message)) return fail(ErrorCode::Limit, refused->reason);
    const auto* welcome = std::get_if<wire::Welcome>(&*message);
    if (welcome == nullptr) return fail(ErrorCode::Corrupt, "the server's first message is no welcome");
    welcome_ = *welcome;
    return {};
  }
}

Result<std::span<const std::byte>> Line::nextMessage() {
  for (;;) {
    const ws::FrameReader::Frame frame = frames_.next();
    if (frame.got == ws::FrameReader::Got::Binary) return frame.payload;
    if (frame.got == ws::FrameReader::Got::Nothing) {
      const auto room = frames_.room();
      const ssize_t count = ::recv(handle(), room.data(), room.size(), 0);
      if (count <= 0) return fail(ErrorCode::Io, "the server ended the line without a welcome");
      frames_.filled(static_cast<std::size_t>(count));
      continue;
    }
    control(frame);
    if (ended_) return fail(ErrorCode::Io, "the server closed the line");
  }
}

bool Line::send(std::uint32_t first_seq, std::span<const session::Input> poses) {
  if (!hasUnsent()) out_.clear(), sent_ = 0;
  // The same bytes as wire::encode, without its allocations.
  ws::writeFrameHeader(out_, ws::Opcode::Binary, 8 + poses.size() * wire::kBytesPerPose, ws::Side::Client);
  out_.u32(0);  // the mask
  out_.u8(static_cast<std::uint8_t>(wire::MessageType::Poses)), out_.u8(wire::kDrillProtocolVersion);
  out_.u32(first_seq), out_.u16(static_cast<std::uint16_t>(poses.size()));
  for (const session::Input& pose : poses) {
    out_.u64(pose.t_us), out_.vec3(pose.tip_mm), out_.vec3(pose.axis), out_.u8(pose.spinning ? 1 : 0);
  }
  return flush();
}

bool Line::sendFinish() {
  ws::writeFrame(out_, ws::Opcode::Binary, wire::encode(wire::ClientMessage(wire::Finish{})), ws::Side::Client);
  return flush();
}

bool Line::flush() {
  while (hasUnsent()) {
    const auto left = std::span(out_.bytes()).subspan(sent_);
    const ssize_t count = ::send(handle(), left.data(), left.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0) return errno == EAGAIN || errno == EINTR;
    sent_ += static_cast<std::size_t>(count);
  }
  return true;
}

/// True when there was something.
bool Line::readOnce() {
  const auto room = frames_.room();
  const ssize_t count = ::recv(handle(), room.data(), room.size(), MSG_DONTWAIT);
  more_ = count == static_cast<ssize_t>(room.size());
  if (count > 0) frames_.filled(static_cast<std::size_t>(count));
  ended_ = count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
  return count > 0;
}

void Line::control(const ws::FrameReader::Frame& frame) {
  if (frame.got == ws::FrameReader::Got::Pong) return;
  if (frame.got == ws::FrameReader::Got::Ping) {
    ws::writeFrame(out_, ws::Opcode::Pong, frame.payload, ws::Side::Client);
    if (flush()) return;
  }
  ended_ = true;  // closed, or no WebSocket
}

}  // namespace spinaltap::haptic_client
