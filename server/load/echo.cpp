#include "server/load/echo.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>

namespace spinaltap::load {
namespace {

constexpr std::size_t kPoseFrame = 2 + 4 + 8 + wire::kBytesPerPose;  // header, mask, message
constexpr std::size_t kSeqAt = 2 + 4 + 2;                            // in such a frame
constexpr std::size_t kFeedbackFrame = 4 + wire::kFeedbackBytes;

std::array<std::byte, kFeedbackFrame> feedbackFrame() {
  wire::ByteWriter out;
  ws::writeFrame(out, ws::Opcode::Binary, wire::encode(wire::ServerMessage(wire::Feedback{})), ws::Side::Server);
  std::array<std::byte, kFeedbackFrame> frame{};
  std::memcpy(frame.data(), out.bytes().data(), frame.size());
  return frame;
}

}  // namespace

struct Echo::Peer {
  haptic_client::Socket socket;
  std::array<std::byte, 64 * kPoseFrame> in{};
  std::size_t have = 0;  ///< of a frame whose rest is still to come
};

Echo::Echo() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)), poll_(::epoll_create1(EPOLL_CLOEXEC)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      ::listen(listener_, 128) == 0 && ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0) {
    port_ = ntohs(address.sin_port);
  }
  thread_ = std::thread([this] { run(); });
}

Echo::~Echo() {
  ending_ = true;
  thread_.join();
  ::close(listener_);
  ::close(poll_);
}

Result<haptic_client::Line> Echo::connect() {
  auto here = haptic_client::connectTo({"127.0.0.1", port_}, std::chrono::seconds(30));
  if (!here) return tl::unexpected(here.error());
  haptic_client::Socket there(::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  const int yes = 1;
  ::setsockopt(there.handle(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  epoll_event event{};
  event.events = EPOLLIN;
  auto peer = std::make_unique<Peer>(Peer{std::move(there), {}, 0});
  event.data.ptr = peer.get();
  if (::epoll_ctl(poll_, EPOLL_CTL_ADD, peer->socket.handle(), &event) != 0) {
    return fail(ErrorCode::Io, "load: the echo has no handle left");
  }
  peers_.push_back(std::move(peer));
  return haptic_client::Line(std::move(*here));
}

void Echo::run() {
  std::array<epoll_event, 128> events{};
  while (!ending_) {
    const int count = ::epoll_wait(poll_, events.data(), static_cast<int>(events.size()), 50);
    for (int i = 0; i < count; ++i) answer(*static_cast<Peer*>(events[static_cast<std::size_t>(i)].data.ptr));
  }
}

void Echo::answer(Peer& peer) {
  static thread_local std::array<std::byte, kFeedbackFrame> frame = feedbackFrame();
  const int socket = peer.socket.handle();
  const ssize_t count = ::recv(socket, peer.in.data() + peer.have, peer.in.size() - peer.have, 0);
  if (count <= 0) {
    ::epoll_ctl(poll_, EPOLL_CTL_DEL, socket, nullptr);
    return;
  }
  peer.have += static_cast<std::size_t>(count);
  std::size_t at = 0;
  for (; at + kPoseFrame <= peer.have; at += kPoseFrame) {
    std::memcpy(frame.data() + 4 + 2, peer.in.data() + at + kSeqAt, 4);
    if (::send(socket, frame.data(), frame.size(), MSG_NOSIGNAL) < 0) return;
  }
  peer.have -= at;
  std::memmove(peer.in.data(), peer.in.data() + at, peer.have);
}

}  // namespace spinaltap::load
