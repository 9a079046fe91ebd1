// server/ws/frames.h - WebSocket frames (RFC 6455) to messages and back, without sockets; either side of the line.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/wire/bytes.h"

namespace spinaltap::ws {

/// Just above the largest batch of poses.
inline constexpr std::size_t kMostMessageBytes = 256 << 10;

enum class Opcode : std::uint8_t { Continuation = 0, Text = 1, Binary = 2, Close = 8, Ping = 9, Pong = 10 };
enum class Side : std::uint8_t { Client, Server };

/// Bytes as they come, messages as they are whole. Total over any bytes; holds at most one message and what was read
/// with it.
class FrameReader {
 public:
  enum class Got : std::uint8_t {
    Nothing,  ///< more bytes are needed
    Binary,
    Text,
    Ping,
    Pong,
    Close,
    Malformed,  ///< this is no WebSocket: close with 1002 and read no further
    TooLarge,   ///< over kMostMessageBytes: close with 1009 and read no further
  };
  struct Frame {
    Got got = Got::Nothing;
    std::span<std::byte> payload;  ///< unmasked; valid until the next call of any function
  };

  /// @param sender  whose frames these are: those of a client are masked, those of a server are not.
  explicit FrameReader(Side sender) : sender_(sender) {}

  /// Where the next bytes go; never empty.
  [[nodiscard]] std::span<std::byte> room();
  void filled(std::size_t count) { end_ += count; }
  [[nodiscard]] Frame next();
  /// Bytes that wait.
  [[nodiscard]] std::size_t waiting() const { return end_ - begin_; }

 private:
  struct Header {
    Opcode opcode = Opcode::Binary;
    bool final = true;
    std::size_t size = 0, bytes = 0;  ///< of the payload, of the header
  };
  enum class Read : std::uint8_t { More, Whole, Malformed, TooLarge };
  Read readHeader(Header& header) const;
  Frame take(const Header& header);

  Side sender_;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(std::size_t{16} << 10);
  std::size_t begin_ = 0, end_ = 0;
  std::size_t wanted_ = 0;            ///< the frame at begin_ needs so many bytes, once its header is known
  std::vector<std::byte> fragments_;  ///< of a message that comes in several frames
  bool fragmented_ = false, handed_out_ = false;
  Opcode fragments_are_ = Opcode::Binary;
};

/// Appends one whole frame. `mask` is what a client must give; 0 is a mask too, and leaves the bytes as they are.
void writeFrame(wire::ByteWriter& out, Opcode opcode, std::span<const std::byte> payload, Side sender,
                std::uint32_t mask = 0);
/// The header alone; the payload follows as it is.
void writeFrameHeader(wire::ByteWriter& out, Opcode opcode, std::size_t payload_bytes, Side sender);

}  // namespace spinaltap::ws
