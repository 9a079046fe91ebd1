#include "server/import/child/output.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "core/wire/bytes.h"

namespace spinaltap::importer {

namespace {

void writeAll(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = write(fd, bytes.data(), bytes.size());
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) _exit(3);
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

std::string last_file;

}  // namespace

void Output::frame(FrameType type, std::span<const std::byte> payload) {
  wire::ByteWriter head;
  head.u8(static_cast<std::uint8_t>(type));
  head.u32(static_cast<std::uint32_t>(payload.size()));
  writeAll(STDOUT_FILENO, head.bytes());
  writeAll(STDOUT_FILENO, payload);
}

void Output::accepted(const AcceptedHeader& header) { frame(FrameType::Accepted, encodeAccepted(header)); }

void Output::hu(std::span<const std::int16_t> values) {
  std::vector<std::byte> bytes;
  while (!values.empty()) {
    const auto part = values.first(std::min<std::size_t>(values.size(), kMaxFrameBytes / 2));
    bytes.resize(2 * part.size());
    for (std::size_t i = 0; i < part.size(); ++i) {
      const auto value = static_cast<std::uint16_t>(part[i]);
      bytes[2 * i] = static_cast<std::byte>(value & 0xff);
      bytes[2 * i + 1] = static_cast<std::byte>(value >> 8);
    }
    frame(FrameType::Hu, bytes);
    values = values.subspan(part.size());
  }
}

void Output::label(std::span<const std::uint8_t> values) {
  while (!values.empty()) {
    const auto part = values.first(std::min<std::size_t>(values.size(), kMaxFrameBytes));
    frame(FrameType::Label, std::as_bytes(part));
    values = values.subspan(part.size());
  }
}

void Output::note(std::string_view text) {
  const std::string line = oneLine(text);
  frame(FrameType::Note, std::as_bytes(std::span(line)));
}

void Output::refused(const Error& error) {
  const std::string line = oneLine(error.message);
  wire::ByteWriter payload;
  payload.u8(static_cast<std::uint8_t>(error.code));
  payload.raw(std::as_bytes(std::span(line)));
  frame(FrameType::Refused, payload.bytes());
}

void Output::end() { frame(FrameType::End, {}); }

void reportProgress(std::string_view stage, std::size_t done, std::size_t total, std::string_view file) {
  if (!file.empty()) last_file = oneLine(file, 120);
  std::string line =
      "{\"stage\":\"" + oneLine(stage) + "\",\"done\":" + std::to_string(done) + ",\"total\":" + std::to_string(total);
  if (!file.empty()) line += ",\"file\":\"" + last_file + "\"";
  line += "}\n";
  writeAll(kProgressDescriptor, std::as_bytes(std::span(line)));
}

std::string fileInWork() { return last_file.empty() ? "the input" : last_file; }

}  // namespace spinaltap::importer
