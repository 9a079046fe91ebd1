// server/haptic_client/line.h - a client's WebSocket of one drill: messages out and in, without waiting.
#pragma once
#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

#include "core/wire/drill_messages.h"
#include "server/haptic_client/socket.h"
#include "server/ws/frames.h"

namespace spinaltap::haptic_client {

/// Used by one thread.
class Line {
 public:
  /// A line to something that answers frames, without a handshake.
  explicit Line(Socket socket) : socket_(std::move(socket)) {}
  /// The session's WebSocket, hello said and welcome read; blocks for at most `patience` a step.
  /// @error Io; NotFound: no such session; Limit: refused, in the server's own words; Corrupt.
  [[nodiscard]] static Result<Line> open(const Address& server, const std::string& session, const wire::Hello& hello,
                                         std::chrono::milliseconds patience);

  /// Of a line that was opened.
  [[nodiscard]] const wire::Welcome& welcome() const { return welcome_; }
  [[nodiscard]] int handle() const { return socket_.handle(); }

  /// What the system does not take at once waits: look at hasUnsent() before sending more. False when the other side is
  /// gone. @pre 1 to wire::kMaxPosesPerBatch poses.
  [[nodiscard]] bool send(std::uint32_t first_seq, std::span<const session::Input> poses);
  [[nodiscard]] bool sendFinish();
  [[nodiscard]] bool hasUnsent() const { return sent_ < out_.bytes().size(); }
  [[nodiscard]] bool flush();

  /// Reads what there is; each(bytes) for every message, pings answered. False when the line ended: nothing comes any
  /// more. Messages that came before are handed out first.
  template <class Each>
  [[nodiscard]] bool receive(const Each& each) {
    handOut(each);  // what came with the welcome
    while (!ended_ && readOnce()) {
      handOut(each);
      if (!more_) break;
    }
    return !ended_;
  }

 private:
  template <class Each>
  void handOut(const Each& each) {
    for (auto frame = frames_.next(); frame.got != ws::FrameReader::Got::Nothing && !ended_; frame = frames_.next()) {
      if (frame.got == ws::FrameReader::Got::Binary) {
        each(std::span<const std::byte>(frame.payload));
      } else {
        control(frame);
      }
    }
  }
  bool readOnce();
  void control(const ws::FrameReader::Frame& frame);
  [[nodiscard]] Result<void> greet(const wire::Hello& hello);
  [[nodiscard]] Result<std::span<const std::byte>> nextMessage();

  Socket socket_;
  ws::FrameReader frames_{ws::Side::Server};
  wire::ByteWriter out_;
  std::size_t sent_ = 0;
  bool more_ = false, ended_ = false;
  wire::Welcome welcome_;
};

}  // namespace spinaltap::haptic_client
