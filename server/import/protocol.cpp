#include "server/import/protocol.h"

#include <algorithm>
#include <utility>

#include "core/wire/bytes.h"
#include "server/import/grid_bytes.h"

namespace spinaltap::importer {
namespace {

constexpr std::uint32_t kRequestMagic = 0x31495453;  // "STI1"

std::string textOf(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::vector<std::byte> encodeRequest(const ImportRequest& request) {
  wire::ByteWriter out;
  out.u32(kRequestMagic);
  out.text(request.from.native());
  out.u8(request.label ? 1 : 0);
  out.text(request.label ? request.label->file.native() : std::string());
  out.i32(request.label ? request.label->value : 0);
  out.i32(request.series);
  out.u8(request.allow_single_slice ? 1 : 0);
  out.u64(static_cast<std::uint64_t>(request.limits.wall_time.count()));
  out.u64(request.limits.memory_bytes);
  out.u64(request.limits.input_bytes);
  out.u64(request.limits.voxels);
  out.u32(request.limits.files);
  return out.take();
}

Result<ImportRequest> decodeRequest(std::span<const std::byte> bytes) {
  wire::ByteReader in(bytes);
  ImportRequest request;
  const bool magic = in.u32() == kRequestMagic;
  request.from = in.text();
  const bool has_label = in.u8() == 1;
  LabelRequest label;
  label.file = in.text();
  label.value = in.i32();
  if (has_label) request.label = std::move(label);
  request.series = in.i32();
  request.allow_single_slice = in.u8() == 1;
  request.limits.wall_time = std::chrono::milliseconds(in.u64());
  request.limits.memory_bytes = in.u64();
  request.limits.input_bytes = in.u64();
  request.limits.voxels = in.u64();
  request.limits.files = in.u32();
  if (!magic || in.failed() || in.left() != 0) return fail(ErrorCode::Corrupt, "the import request is broken");
  return request;
}

std::vector<std::byte> encodeAccepted(const AcceptedHeader& header) {
  wire::ByteWriter out;
  out.u8(static_cast<std::uint8_t>(header.source));
  writeGrid(out, header.grid);
  out.u8(header.has_label ? 1 : 0);
  return out.take();
}

std::string oneLine(std::string_view text, std::size_t limit) {
  std::string line(text.substr(0, limit));
  for (char& c : line) {
    if (c < 0x20 || c > 0x7e || c == '"' || c == '\\') c = '?';
  }
  return line;
}

Result<void> FrameReader::feed(std::span<const std::byte> bytes) {
  pending_.insert(pending_.end(), bytes.begin(), bytes.end());
  std::size_t used = 0;
  while (true) {
    wire::ByteReader in(std::span<const std::byte>(pending_).subspan(used));
    const std::uint8_t type = in.u8();
    const std::uint32_t length = in.u32();
    if (in.failed()) break;
    if (length > kMaxFrameBytes) return fail(ErrorCode::Corrupt, "the importer sent an oversized frame");
    const std::span<const std::byte> payload = in.raw(length);
    if (in.failed()) break;
    if (type < static_cast<std::uint8_t>(FrameType::Accepted) || type > static_cast<std::uint8_t>(FrameType::Refused)) {
      return fail(ErrorCode::Corrupt, "the importer sent a frame of an unknown kind");
    }
    if (auto done = frame(static_cast<FrameType>(type), payload); !done) return done;
    used += in.offset();
  }
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(used));
  return {};
}

Result<void> FrameReader::frame(FrameType type, std::span<const std::byte> payload) {
  if (ended_ || refused_) return fail(ErrorCode::Corrupt, "the importer went on after its end");
  switch (type) {
    case FrameType::Accepted:
      return accepted(payload);
    case FrameType::Hu:
      return hu(payload);
    case FrameType::Label:
      return label(payload);
    case FrameType::Note:
      if (volume_.notes.size() < kMaxNotes) volume_.notes.push_back(oneLine(textOf(payload)));
      return {};
    case FrameType::End:
      ended_ = true;
      return {};
    case FrameType::Refused:
      refuse(payload);
      return {};
  }
  return {};
}

Result<void> FrameReader::accepted(std::span<const std::byte> payload) {
  wire::ByteReader in(payload);
  const std::uint8_t source = in.u8();
  volume::Grid grid = readGrid(in);
  const bool has_label = in.u8() == 1;
  if (in.failed() || in.left() != 0 || has_header_ || source > static_cast<std::uint8_t>(SourceKind::Nifti) ||
      has_label != label_asked_) {
    return fail(ErrorCode::Corrupt, "the importer sent a broken header");
  }
  if (auto good = volume::checkGrid(grid); !good) return good;
  if (grid.voxels() > limits_.voxels) return fail(ErrorCode::Limit, "the importer sent a volume over the limit");
  has_header_ = true;
  volume_.source = static_cast<SourceKind>(source);
  volume_.ct.grid = grid;
  if (has_label) volume_.label = volume::LabelVolume{grid, {}};
  return {};
}

Result<void> FrameReader::hu(std::span<const std::byte> payload) {
  // The vector grows with what arrives, not with what the header promised.
  std::vector<std::int16_t>& hu = volume_.ct.hu;
  if (!has_header_ || payload.size() % 2 != 0 || hu.size() + payload.size() / 2 > volume_.ct.grid.voxels()) {
    return fail(ErrorCode::Corrupt, "the importer sent more voxels than its header says");
  }
  for (std::size_t i = 0; i < payload.size(); i += 2) {
    const auto low = static_cast<std::uint16_t>(payload[i]);
    const auto high = static_cast<std::uint16_t>(payload[i + 1]);
    hu.push_back(static_cast<std::int16_t>(static_cast<std::uint16_t>(low | (high << 8))));
  }
  return {};
}

Result<void> FrameReader::label(std::span<const std::byte> payload) {
  if (!has_header_ || !volume_.label || volume_.label->inside.size() + payload.size() > volume_.ct.grid.voxels()) {
    return fail(ErrorCode::Corrupt, "the importer sent more labels than its header says");
  }
  for (const std::byte b : payload) volume_.label->inside.push_back(b == std::byte{0} ? 0 : 1);
  return {};
}

void FrameReader::refuse(std::span<const std::byte> payload) {
  wire::ByteReader in(payload);
  const std::uint8_t code = std::min(in.u8(), static_cast<std::uint8_t>(ErrorCode::Limit));
  refusal_ = {static_cast<ErrorCode>(code), oneLine(textOf(in.raw(in.left())))};
  refused_ = true;
}

Result<ImportedVolume> FrameReader::take() {
  const std::size_t voxels = volume_.ct.grid.voxels();
  const bool complete =
      has_header_ && volume_.ct.hu.size() == voxels && (!volume_.label || volume_.label->inside.size() == voxels);
  if (!complete) return fail(ErrorCode::Corrupt, "the importer sent fewer voxels than its header says");
  return std::move(volume_);
}

}  // namespace spinaltap::importer
