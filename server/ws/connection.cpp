#include "server/ws/connection.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace spinaltap::ws {
namespace {

/// What the system queues beyond the network's own window: little, so that a feedback that waits can still be replaced.
constexpr int kUnsentInSystem = 4096;

}  // namespace

Connection::Connection(int socket, std::span<const std::byte> already_read) : socket_(socket) {
  const int yes = 1, little = kUnsentInSystem;
  // neither is there for a socket that is not TCP, which tests use
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &little, sizeof little);
  out_.reserve(2 * kMostUnsentBytes);
  while (!already_read.empty()) {
    const std::span<std::byte> room = frames.room();
    const std::size_t count = std::min(room.size(), already_read.size());
    std::copy_n(already_read.begin(), count, room.begin());
    frames.filled(count);
    already_read = already_read.subspan(count);
  }
}

Connection::~Connection() { ::close(socket_); }

Connection::Received Connection::receiveInto(std::span<std::byte> room, std::size_t& got) {
  ssize_t count = 0;
  do count = ::recv(socket_, room.data(), room.size(), MSG_DONTWAIT);
  while (count < 0 && errno == EINTR);
  got = count > 0 ? static_cast<std::size_t>(count) : 0;
  // less than there was room for is all there is; more of it, or its end, is told anew
  if (got < room.size()) readable = false;
  if (count > 0) return Received::Something;
  return count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK) ? Received::Nothing : Received::Ended;
}

Connection::Received Connection::receive() {
  std::size_t got = 0;
  const Received received = receiveInto(frames.room(), got);
  frames.filled(got);
  return received;
}

Connection::Received Connection::discard() {
  std::array<std::byte, 4096> nowhere{};
  std::size_t got = 0;
  return receiveInto(nowhere, got);
}

void Connection::send(const wire::ServerMessage& message) {
  if (closing_) return;
  if (events_.size() >= kMostEvents) {  // nobody reads: whoever waits for the last of them waits in vain
    broken_ = true;
    return;
  }
  events_.push_back(wire::encode(message));
}

bool Connection::send(const wire::Feedback& feedback, Clock::time_point now) {
  if (closing_) return false;
  const bool coalesced = mailbox_.has_value();
  const session::Status worst = coalesced ? std::max(mailbox_->status, feedback.status) : feedback.status;
  const bool has_hash = feedback.has_hash || (coalesced && mailbox_->has_hash);
  mailbox_ = feedback;
  mailbox_->status = worst;
  mailbox_->has_hash = has_hash;
  fill(now);
  return coalesced;
}

void Connection::pong(std::span<const std::byte> payload) {
  if (closing_ || out_.bytes().size() > 2 * kMostUnsentBytes)
    return;  // who asks so often need not be answered each time
  writeFrame(out_, Opcode::Pong, payload, Side::Server);
}

void Connection::ping() {
  if (!closing_) writeFrame(out_, Opcode::Ping, {}, Side::Server);
}

void Connection::close(std::uint16_t code) {
  if (closing_) return;
  closing_ = true;
  mailbox_.reset();
  close_code_ = code;
}

void Connection::setRate(std::uint32_t hz) {
  spacing_ = hz == 0 ? Clock::duration(0) : Clock::duration(std::chrono::seconds(1)) / hz;
}

void Connection::writeFeedback(Clock::time_point now) {
  writeFrameHeader(out_, Opcode::Binary, wire::kFeedbackBytes, Side::Server);
  wire::encodeFeedback(*mailbox_, out_);
  mailbox_.reset();
  not_before_ = now + spacing_;
}

/// From what waits into what the system is handed next; events first, since they are the older ones or end all.
void Connection::fill(Clock::time_point now) {
  if (sent_ > 0 && sent_ == out_.bytes().size()) out_.clear(), sent_ = 0;
  while (!events_.empty() && out_.bytes().size() < kMostUnsentBytes) {
    writeFrame(out_, Opcode::Binary, events_.front(), Side::Server);
    events_.pop_front();
  }
  if (mailbox_ && !blocked_ && events_.empty() && out_.bytes().size() < kMostUnsentBytes && now >= not_before_) {
    writeFeedback(now);
  }
  if (closing_ && events_.empty() && close_code_ != 0) {
    const std::array<std::byte, 2> code{static_cast<std::byte>(close_code_ >> 8U),
                                        static_cast<std::byte>(close_code_ & 0xffU)};
    writeFrame(out_, Opcode::Close, code, Side::Server);
    close_code_ = 0;
  }
}

bool Connection::flush(Clock::time_point now) {
  if (broken_) return false;
  fill(now);
  while (!blocked_ && sent_ < out_.bytes().size()) {
    const std::span<const std::byte> left = std::span(out_.bytes()).subspan(sent_);
    const ssize_t count = ::send(socket_, left.data(), left.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno != EAGAIN && errno != EWOULDBLOCK) return false;
    if (count < 0) {
      blocked_ = true;
      break;
    }
    sent_ += static_cast<std::size_t>(count);
    stalled_.reset();
    fill(now);
  }
  if (!blocked_) stalled_.reset();
  if (blocked_ && !stalled_) stalled_ = now;
  return true;
}

}  // namespace spinaltap::ws
