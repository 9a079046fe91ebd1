// server/load/line.h - a client's end of one drill: HTTP to make it, WebSocket to drive it.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/wire/drill_messages.h"
#include "server/load/load.h"
#include "server/ws/frames.h"

namespace spinaltap::load {

/// Owns a connected TCP socket.
class Socket {
 public:
  explicit Socket(int handle = -1) : handle_(handle) {}
  Socket(Socket&& other) noexcept;
  Socket& operator=(Socket&& other) noexcept;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket();
  [[nodiscard]] int handle() const { return handle_; }

 private:
  int handle_;
};

/// @error Io.
[[nodiscard]] Result<Socket> connectTo(const std::string& host, std::uint16_t port);

/// One session: made, its WebSocket open, hello said and welcome read; from here on it does not block.
class Line {
 public:
  /// @error Io; NotFound, Limit (as the server says).
  [[nodiscard]] static Result<Line> open(const Target& target, bool rigid);
  /// A line to something that answers frames, without a handshake.
  explicit Line(Socket socket);

  [[nodiscard]] int handle() const { return socket_.handle(); }
  /// False when the other side is gone; a pose that the system does not take at once waits, bounded by the next ones
  /// not being sent.
  [[nodiscard]] bool send(std::uint32_t seq, const session::Input& pose);
  [[nodiscard]] bool hasUnsent() const { return sent_ < out_.bytes().size(); }
  [[nodiscard]] bool flush();
  /// Reads what there is; each(seq) for every feedback, by how many poses it answers. False when the line ended.
  template <class Each>
  [[nodiscard]] bool receive(const Each& each) {
    while (readOnce()) {
      for (auto frame = frames_.next(); frame.got != ws::FrameReader::Got::Nothing; frame = frames_.next()) {
        if (const auto seq = seqOf(frame)) each(*seq);
        if (ended_) return false;
      }
      if (!more_) break;
    }
    return !ended_;
  }

 private:
  bool readOnce();
  std::optional<std::uint32_t> seqOf(const ws::FrameReader::Frame& frame);

  Socket socket_;
  ws::FrameReader frames_{ws::Side::Server};
  wire::ByteWriter out_;
  std::size_t sent_ = 0;
  bool more_ = false, ended_ = false;
};

}  // namespace spinaltap::load
