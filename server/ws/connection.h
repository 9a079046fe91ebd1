// server/ws/connection.h - one WebSocket that does not block: bounded whatever the other side does or leaves undone.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/wire/drill_messages.h"
#include "server/ws/frames.h"

namespace spinaltap::ws {

inline constexpr std::uint16_t kNormal = 1000, kGoingAway = 1001, kProtocolError = 1002, kPolicy = 1008,
                               kTooLarge = 1009, kInternalError = 1011;
using Clock = std::chrono::steady_clock;

/// Used by one thread. What waits to be sent is at most: a few frames that the system did not take, kMostEvents
/// messages, and one feedback, the newest.
class Connection {
 public:
  static constexpr std::size_t kMostEvents = 32;
  static constexpr std::size_t kMostUnsentBytes = 4096;  ///< of feedback that the system has not taken yet

  /// Owns the socket. @param already_read what came with the request for this WebSocket.
  Connection(int socket, std::span<const std::byte> already_read);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection();

  [[nodiscard]] int socket() const { return socket_; }

  enum class Received : std::uint8_t { Something, Nothing, Ended };
  /// Reads once, at most what the reader has room for.
  Received receive();
  /// Reads and throws away.
  Received discard();
  /// Set when the system says that there is something; until receive() has found nothing more.
  bool readable = true;
  FrameReader frames{Side::Client};

  /// Never dropped. A close() or too many of them come first.
  void send(const wire::ServerMessage& message);
  /// Takes the place of a feedback that waits, and answers for it too. True when one had to make room.
  bool send(const wire::Feedback& feedback, Clock::time_point now);
  void pong(std::span<const std::byte> payload);
  void ping();
  /// What was sent before goes out, then the close frame; nothing is sent after it.
  void close(std::uint16_t code);
  /// Hands the system what it takes. False when the connection is broken.
  [[nodiscard]] bool flush(Clock::time_point now);

  /// The system takes more again.
  void writable() { blocked_ = false; }

  /// At most so many feedback messages a second; 0 = as many as there are.
  void setRate(std::uint32_t hz);
  [[nodiscard]] bool isClosing() const { return closing_; }
  /// All is sent, the close frame too.
  [[nodiscard]] bool isDone() const { return closing_ && !waits() && close_code_ == 0; }
  [[nodiscard]] bool waits() const { return sent_ < out_.bytes().size() || !events_.empty() || mailbox_.has_value(); }
  [[nodiscard]] bool holdsFeedback() const { return mailbox_.has_value(); }
  /// Since when the system takes nothing more; none while it does.
  [[nodiscard]] std::optional<Clock::time_point> stalledSince() const { return stalled_; }

 private:
  Received receiveInto(std::span<std::byte> room, std::size_t& got);
  void fill(Clock::time_point now);
  void writeFeedback(Clock::time_point now);

  int socket_;
  wire::ByteWriter out_;
  std::size_t sent_ = 0;  ///< of out_
  std::deque<std::vector<std::byte>> events_;
  std::optional<wire::Feedback> mailbox_;
  Clock::duration spacing_{0};
  Clock::time_point not_before_{};
  std::optional<Clock::time_point> stalled_;
  std::uint16_t close_code_ = 0;
  bool closing_ = false, broken_ = false, blocked_ = false;
};

}  // namespace spinaltap::ws
