// server/import/protocol.h - what the program and spinaltap-import say to each other.
// stdin:  one request (encodeRequest), then end of file. Not the command line: paths may name people, and `ps` shows
// it. stdout: frames: u8 type, u32 length, payload; little-endian. Ends with End or Refused. fd 3:   progress, one JSON
// object a line: {"stage":"read","done":3,"total":80,"file":"1-052.dcm"}. `file` is the base
//         name of what is being parsed, so that a crash can be blamed on it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/import.h"

namespace spinaltap::importer {

inline constexpr int kProgressDescriptor = 3;
inline constexpr std::uint32_t kMaxFrameBytes = 1U << 20;
inline constexpr std::size_t kMaxNotes = 50;

enum class FrameType : std::uint8_t {
  Accepted = 1,  ///< u8 SourceKind, grid: 3 i32 dims, 3 f64 spacing, 3 f64 origin, 9 f64 direction, u8 has label
  Hu = 2,        ///< i16 values, in grid order, continued from the last frame
  Label = 3,     ///< u8 values, in grid order
  Note = 4,      ///< UTF-8 text, one line
  End = 5,       ///< empty
  Refused = 6,   ///< u8 ErrorCode, UTF-8 text
};

[[nodiscard]] std::vector<std::byte> encodeRequest(const ImportRequest& request);
/// @error Corrupt.
[[nodiscard]] Result<ImportRequest> decodeRequest(std::span<const std::byte> bytes);

struct AcceptedHeader {
  SourceKind source = SourceKind::DicomSlices;
  volume::Grid grid;
  bool has_label = false;
};
[[nodiscard]] std::vector<std::byte> encodeAccepted(const AcceptedHeader& header);

/// One line that is safe on a terminal and in a log: control characters, quotes, backslashes, bytes that are not ASCII
/// and anything past `limit` bytes become '?' or are cut.
[[nodiscard]] std::string oneLine(std::string_view text, std::size_t limit = 400);

/// Puts the frames together. The child parsed hostile bytes, so nothing it says is believed: sizes are bounded by
/// `limits`, the grid is checked, text is cleaned.
class FrameReader {
 public:
  FrameReader(ImportLimits limits, bool label_asked) : limits_(limits), label_asked_(label_asked) {}
  /// Takes the next bytes of the stream. @error Corrupt, Limit: stop reading.
  [[nodiscard]] Result<void> feed(std::span<const std::byte> bytes);
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] bool refused() const { return refused_; }
  /// @pre refused().
  [[nodiscard]] const Error& refusal() const { return refusal_; }
  /// @pre ended(). @error Corrupt when voxels are missing.
  [[nodiscard]] Result<ImportedVolume> take();

 private:
  [[nodiscard]] Result<void> frame(FrameType type, std::span<const std::byte> payload);
  [[nodiscard]] Result<void> accepted(std::span<const std::byte> payload);
  [[nodiscard]] Result<void> hu(std::span<const std::byte> payload);
  [[nodiscard]] Result<void> label(std::span<const std::byte> payload);
  void refuse(std::span<const std::byte> payload);

  ImportLimits limits_;
  bool label_asked_;
  bool has_header_ = false, ended_ = false, refused_ = false;
  Error refusal_;
  ImportedVolume volume_;
  std::vector<std::byte> pending_;
};

}  // namespace spinaltap::importer
