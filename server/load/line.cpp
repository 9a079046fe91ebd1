#include "server/load/line.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

namespace spinaltap::load {
namespace {

tl::unexpected<Error> failed(const char* what) {
  return fail(ErrorCode::Io, std::string("load: ") + what + ": " + std::strerror(errno));
}

bool sendAll(int handle, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::send(handle, text.data(), text.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

/// Byte by byte, since what follows belongs to the WebSocket. Answers are a few hundred bytes.
std::string receiveHead(int handle) {
  std::string head;
  char c = 0;
  while (head.size() < 16384 && (head.size() < 4 || head.compare(head.size() - 4, 4, "\r\n\r\n") != 0)) {
    if (::recv(handle, &c, 1, 0) != 1) return {};
    head += c;
  }
  return head;
}

Result<std::string> makeSession(const Target& target) {
  auto socket = connectTo(target.host, target.port);
  if (!socket) return tl::unexpected(socket.error());
  const std::string body = nlohmann::json{{"case_id", target.case_id}, {"path_id", target.path_id}}.dump();
  const std::string request =
      "POST /api/v1/sessions HTTP/1.1\r\nHost: " + target.host +
      "\r\nContent-Type: application/json\r\nConnection: close\r\nContent-Length: " + std::to_string(body.size()) +
      "\r\n\r\n" + body;
  if (!sendAll(socket->handle(), request)) return failed("asking for a session");
  const std::string head = receiveHead(socket->handle());
  std::string answer;
  std::array<char, 1024> some{};
  for (ssize_t count = 0; (count = ::recv(socket->handle(), some.data(), some.size(), 0)) > 0;) {
    answer.append(some.data(), static_cast<std::size_t>(count));
  }
  const auto json = nlohmann::json::parse(answer, nullptr, false);
  if (head.rfind("HTTP/1.1 201", 0) == 0 && json.is_object() && json.contains("id"))
    return json["id"].get<std::string>();
  const std::string detail = json.is_object() ? json.value("detail", "") : "";
  return fail(ErrorCode::NotFound,
              "load: the server made no session: " + (detail.empty() ? head.substr(0, 40) : detail));
}

Result<void> upgrade(int handle, const Target& target, const std::string& id) {
  const std::string request = "GET /ws/drill/" + id + " HTTP/1.1\r\nHost: " + target.host +
                              "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  if (!sendAll(handle, request)) return failed("opening a WebSocket");
  const std::string head = receiveHead(handle);
  if (head.rfind("HTTP/1.1 101", 0) == 0) return {};
  return fail(ErrorCode::Limit, "load: the server opened no WebSocket: " + head.substr(0, head.find('\r')));
}

}  // namespace

Socket::Socket(Socket&& other) noexcept : handle_(std::exchange(other.handle_, -1)) {}
Socket& Socket::operator=(Socket&& other) noexcept {
  std::swap(handle_, other.handle_);
  return *this;
}
Socket::~Socket() {
  if (handle_ >= 0) ::close(handle_);
}

Result<Socket> connectTo(const std::string& host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (::inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) {
    return fail(ErrorCode::InvalidArgument, "load: '" + host + "' is not an IPv4 address");
  }
  Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const timeval patience{30, 0};
  const int yes = 1;
  ::setsockopt(socket.handle(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  ::setsockopt(socket.handle(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  if (::connect(socket.handle(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return failed("connecting");
  }
  return socket;
}

Line::Line(Socket socket) : socket_(std::move(socket)) {
  ::fcntl(socket_.handle(), F_SETFL, ::fcntl(socket_.handle(), F_GETFL) | O_NONBLOCK);
}

Result<Line> Line::open(const Target& target, bool rigid) {
  const auto id = makeSession(target);
  if (!id) return tl::unexpected(id.error());
  auto socket = connectTo(target.host, target.port);
  if (!socket) return tl::unexpected(socket.error());
  if (const auto opened = upgrade(socket->handle(), target, *id); !opened) return tl::unexpected(opened.error());
  wire::Hello how;
  how.rigid = rigid;
  wire::ByteWriter hello;
  ws::writeFrame(hello, ws::Opcode::Binary, wire::encode(wire::ClientMessage(how)), ws::Side::Client);
  if (!sendAll(socket->handle(), {reinterpret_cast<const char*>(hello.bytes().data()), hello.bytes().size()})) {
    return failed("saying hello");
  }
  ws::FrameReader frames(ws::Side::Server);
  ws::FrameReader::Frame frame = frames.next();
  while (frame.got == ws::FrameReader::Got::Nothing) {
    const auto room = frames.room();
    const ssize_t count = ::recv(socket->handle(), room.data(), room.size(), 0);
    if (count <= 0) return failed("waiting for the welcome");
    frames.filled(static_cast<std::size_t>(count));
    frame = frames.next();
  }
  const auto message = wire::decodeServerMessage(frame.payload);
  if (!message) return fail(ErrorCode::Corrupt, "load: the server's welcome: " + message.error().message);
  if (const auto* refused = std::get_if<wire::Refused>(&*message)) {
    return fail(ErrorCode::Limit, "load: the server refused: " + refused->reason);
  }
  return Line(std::move(*socket));
}

bool Line::send(std::uint32_t seq, const session::Input& pose) {
  if (!hasUnsent()) out_.clear(), sent_ = 0;
  // The same bytes as wire::encode, without its allocations: this side must not be what is measured.
  ws::writeFrameHeader(out_, ws::Opcode::Binary, 8 + wire::kBytesPerPose, ws::Side::Client);
  out_.u32(0);  // the mask
  out_.u8(static_cast<std::uint8_t>(wire::MessageType::Poses)), out_.u8(wire::kDrillProtocolVersion);
  out_.u32(seq), out_.u16(1);
  out_.u64(pose.t_us), out_.vec3(pose.tip_mm), out_.vec3(pose.axis), out_.u8(pose.spinning ? 1 : 0);
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

bool Line::readOnce() {
  const auto room = frames_.room();
  const ssize_t count = ::recv(handle(), room.data(), room.size(), MSG_DONTWAIT);
  more_ = count == static_cast<ssize_t>(room.size());
  if (count > 0) frames_.filled(static_cast<std::size_t>(count));
  ended_ = count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR);
  return count > 0;
}

std::optional<std::uint32_t> Line::seqOf(const ws::FrameReader::Frame& frame) {
  if (frame.got != ws::FrameReader::Got::Binary || frame.payload.size() < 6) {
    ended_ = frame.got != ws::FrameReader::Got::Ping;
    return {};
  }
  wire::ByteReader in(frame.payload);
  const auto type = static_cast<wire::MessageType>(in.u8());
  in.u8();
  if (type == wire::MessageType::Feedback && frame.payload.size() == wire::kFeedbackBytes) return in.u32();
  ended_ = type == wire::MessageType::Refused || type == wire::MessageType::Finished;
  return {};
}

}  // namespace spinaltap::load
