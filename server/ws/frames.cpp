#include "server/ws/frames.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace spinaltap::ws {
namespace {

constexpr std::size_t kMostHeaderBytes = 14, kMostControlBytes = 125;

void unmask(std::span<std::byte> bytes, std::span<const std::byte> mask) {
  std::array<std::byte, 8> twice{};
  std::memcpy(twice.data(), mask.data(), 4);
  std::memcpy(twice.data() + 4, mask.data(), 4);
  std::uint64_t word = 0;
  std::memcpy(&word, twice.data(), sizeof word);
  if (word == 0) return;
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t some = 0;
    std::memcpy(&some, bytes.data() + i, sizeof some);
    some ^= word;
    std::memcpy(bytes.data() + i, &some, sizeof some);
  }
  for (; i < bytes.size(); ++i) bytes[i] ^= twice[i % 8];
}

bool isControl(Opcode opcode) { return opcode >= Opcode::Close; }

FrameReader::Got gotOf(Opcode opcode) {
  switch (opcode) {
    case Opcode::Text:
      return FrameReader::Got::Text;
    case Opcode::Ping:
      return FrameReader::Got::Ping;
    case Opcode::Pong:
      return FrameReader::Got::Pong;
    case Opcode::Close:
      return FrameReader::Got::Close;
    default:
      return FrameReader::Got::Binary;
  }
}

}  // namespace

std::span<std::byte> FrameReader::room() {
  if (begin_ == end_) begin_ = end_ = 0;
  const bool full = end_ == buffer_.size();
  if (full || begin_ + wanted_ > buffer_.size()) {
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
              buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
    end_ -= begin_, begin_ = 0;
    // a frame is at most kMostMessageBytes, so that is all this ever grows to
    if (wanted_ > buffer_.size()) buffer_.resize(kMostMessageBytes + kMostHeaderBytes);
    if (end_ == buffer_.size()) buffer_.resize(2 * buffer_.size());
  }
  return std::span(buffer_).subspan(end_);
}

FrameReader::Read FrameReader::readHeader(Header& header) const {
  const std::byte* at = buffer_.data() + begin_;
  const std::size_t have = end_ - begin_;
  if (have < 2) return Read::More;
  const auto first = std::to_integer<unsigned>(at[0]), second = std::to_integer<unsigned>(at[1]);
  const unsigned opcode = first & 15U;
  const bool masked = (second & 0x80U) != 0, known = opcode <= 2 || (opcode >= 8 && opcode <= 10);
  if ((first & 0x70U) != 0 || !known || masked != (sender_ == Side::Client)) return Read::Malformed;
  header.opcode = static_cast<Opcode>(opcode);
  header.final = (first & 0x80U) != 0;
  std::uint64_t size = second & 0x7fU;
  const std::size_t more = size == 127 ? 8 : size == 126 ? 2 : 0;
  if (isControl(header.opcode) && (!header.final || more > 0)) return Read::Malformed;
  header.bytes = 2 + more + (masked ? 4 : 0);
  if (have < header.bytes) return Read::More;
  if (more > 0) size = 0;
  for (std::size_t i = 0; i < more; ++i) size = size << 8U | std::to_integer<std::uint64_t>(at[2 + i]);
  if (size > kMostMessageBytes) return Read::TooLarge;
  header.size = static_cast<std::size_t>(size);
  return Read::Whole;
}

FrameReader::Frame FrameReader::take(const Header& header) {
  const std::span<std::byte> payload = std::span(buffer_).subspan(begin_ + header.bytes, header.size);
  if (sender_ == Side::Client) unmask(payload, std::span(buffer_).subspan(begin_ + header.bytes - 4, 4));
  begin_ += header.bytes + header.size;
  wanted_ = 0;
  if (isControl(header.opcode)) return {gotOf(header.opcode), payload};
  if ((header.opcode == Opcode::Continuation) != fragmented_) return {Got::Malformed, {}};
  if (header.final && !fragmented_) return {gotOf(header.opcode), payload};
  if (!fragmented_) fragments_are_ = header.opcode;
  if (fragments_.size() + payload.size() > kMostMessageBytes) return {Got::TooLarge, {}};
  fragments_.insert(fragments_.end(), payload.begin(), payload.end());
  fragmented_ = !header.final;
  if (fragmented_) return {};
  handed_out_ = true;
  return {gotOf(fragments_are_), fragments_};
}

FrameReader::Frame FrameReader::next() {
  if (handed_out_) fragments_.clear();
  handed_out_ = false;
  for (;;) {
    Header header;
    const Read read = readHeader(header);
    if (read == Read::Malformed) return {Got::Malformed, {}};
    if (read == Read::TooLarge) return {Got::TooLarge, {}};
    if (read == Read::More) return {};
    wanted_ = header.bytes + header.size;
    if (end_ - begin_ < wanted_) return {};
    const Frame frame = take(header);
    if (frame.got != Got::Nothing) return frame;
  }
}

void writeFrameHeader(wire::ByteWriter& out, Opcode opcode, std::size_t payload_bytes, Side sender) {
  out.u8(static_cast<std::uint8_t>(0x80U | static_cast<unsigned>(opcode)));
  const unsigned masked = sender == Side::Client ? 0x80U : 0;
  const bool wide = payload_bytes > 0xffff;
  if (payload_bytes < 126) {
    out.u8(static_cast<std::uint8_t>(masked | payload_bytes));
    return;
  }
  out.u8(static_cast<std::uint8_t>(masked | (wide ? 127U : 126U)));
  for (unsigned shift = wide ? 64 : 16; shift > 0; shift -= 8) {
    out.u8(static_cast<std::uint8_t>(static_cast<std::uint64_t>(payload_bytes) >> (shift - 8)));
  }
}

void writeFrame(wire::ByteWriter& out, Opcode opcode, std::span<const std::byte> payload, Side sender,
                std::uint32_t mask) {
  writeFrameHeader(out, opcode, payload.size(), sender);
  if (sender == Side::Server) {
    out.raw(payload);
    return;
  }
  std::array<std::byte, 4> key{};
  std::memcpy(key.data(), &mask, key.size());
  out.raw(key);
  if (mask == 0) {
    out.raw(payload);
    return;
  }
  for (std::size_t i = 0; i < payload.size(); ++i) out.u8(std::to_integer<std::uint8_t>(payload[i] ^ key[i % 4]));
}

}  // namespace spinaltap::ws
