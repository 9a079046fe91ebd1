// server/import/child/output.h - the child's side of the pipes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/protocol.h"

namespace spinaltap::importer {

/// Frames on stdout. A parent that is gone ends the process.
class Output {
 public:
  void accepted(const AcceptedHeader& header);
  void hu(std::span<const std::int16_t> values);
  void label(std::span<const std::uint8_t> values);
  void note(std::string_view text);
  void refused(const Error& error);
  void end();

 private:
  void frame(FrameType type, std::span<const std::byte> payload);
};

/// Progress on descriptor 3. `file` is what the parser is given next; a crash is blamed on it.
void reportProgress(std::string_view stage, std::size_t done, std::size_t total, std::string_view file = {});
/// The last one reported, for errors that come from below the parser.
[[nodiscard]] std::string fileInWork();

}  // namespace spinaltap::importer
