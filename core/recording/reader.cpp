#include <limits>
#include <optional>

#include "core/recording/format.h"
#include "core/recording/input_code.h"
#include "core/recording/recording.h"

namespace spinaltap::recording {
namespace {

tl::unexpected<Error> corrupt(std::size_t offset, const std::string& why) {
  return fail(ErrorCode::Corrupt, "recording: " + why + " at byte " + std::to_string(offset));
}

struct Chunk {
  Kind kind = Kind::Header;
  std::size_t payload_offset = 0;
  std::span<const std::byte> payload;
};

/// The chunks, in order, each checked against the chain.
class ChunkReader {
 public:
  ChunkReader(std::span<const std::byte> bytes, std::uint32_t version)
      : bytes_(bytes), at_(8), previous_(preambleOf(version)) {}

  /// Nothing when the file ends inside the chunk, or just before it.
  Result<std::optional<Chunk>> next() {
    if (left() < kChunkHeadBytes) return std::nullopt;
    wire::ByteReader head(bytes_.subspan(at_, kChunkHeadBytes));
    Chunk chunk;
    chunk.kind = static_cast<Kind>(head.u8());
    const std::uint32_t size = head.u32();
    if (head.u32() != static_cast<std::uint32_t>(headHash(previous_, chunk.kind, size))) {
      return corrupt(at_, "a chunk whose head does not match its check");
    }
    if (left() - kChunkHeadBytes < std::uint64_t{size} + kChunkTailBytes) return std::nullopt;
    chunk.payload_offset = at_ + kChunkHeadBytes;
    chunk.payload = bytes_.subspan(chunk.payload_offset, size);
    wire::ByteReader tail(bytes_.subspan(chunk.payload_offset + size, kChunkTailBytes));
    previous_ = checksum(previous_, chunk.kind, chunk.payload);
    if (tail.u64() != previous_) return corrupt(at_, "a chunk that does not match its checksum");
    at_ = chunk.payload_offset + size + kChunkTailBytes;
    return chunk;
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] std::size_t offset() const { return at_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_;
  std::uint64_t previous_;
};

template <class T>
bool readColumn(wire::ByteReader& in, std::uint64_t count, std::vector<T>& values) {
  const auto form = static_cast<ColumnForm>(in.u8());
  if (form == ColumnForm::Plain) {
    values = in.array<T>(count);
    return !in.failed();
  }
  if (form != ColumnForm::Runs) return false;
  values.clear();
  values.reserve(static_cast<std::size_t>(count));
  for (std::uint32_t runs = in.u32(); runs > 0; --runs) {
    const std::uint32_t length = in.u32();
    const std::vector<T> value = in.array<T>(1);
    if (in.failed() || length == 0 || length > count - values.size()) return false;
    values.insert(values.end(), length, value[0]);
  }
  return !in.failed() && values.size() == count;
}

Result<Header> readHeader(const Chunk& chunk, std::uint32_t version) {
  wire::ByteReader in(chunk.payload);
  Header header;
  for (std::string* text :
       {&header.core_version, &header.case_id, &header.path_id, &header.scene, &header.config.engine}) {
    *text = in.text(kMaxTextBytes);
  }
  plan::Bit& bit = header.config.bit;
  bit.diameter_mm = in.f64(), bit.cone_length_mm = in.f64(), bit.length_mm = in.f64();
  if (version > 2) {
    header.config.speed_rpm = in.f64();
    haptics::Coupling coupling;
    coupling.stiffness_N_mm = in.f64(), coupling.damping_N_s_mm = in.f64();
    if (coupling != haptics::Coupling{0, 0}) header.config.coupling = coupling;
  }
  if (in.failed() || in.left() != 0) return corrupt(chunk.payload_offset, "a header of the wrong length");
  return header;
}

Result<point_volume::PointVolume> readVolume(const Chunk& chunk) {
  wire::ByteReader in(chunk.payload);
  point_volume::PointVolume volume;
  volume.lattice.spacing_mm = in.f64();
  volume.lattice.rings = in.i32(), volume.lattice.discs = in.i32(), volume.lattice.first_disc = in.i32();
  if (in.failed()) return corrupt(chunk.payload_offset, "a lattice of the wrong length");
  if (auto ok = point_volume::checkLattice(volume.lattice); !ok) {
    return corrupt(chunk.payload_offset, "no lattice (" + ok.error().message + ")");
  }
  const std::uint64_t points = volume.lattice.points();
  if (points > kMaxPoints) {
    return fail(ErrorCode::Limit, "recording: more than " + std::to_string(kMaxPoints) + " points");
  }
  if (!readColumn(in, (points + 63) / 64, volume.alive) || !readColumn(in, points, volume.density_mg_cm3) ||
      in.left() != 0) {
    return corrupt(chunk.payload_offset + in.offset(), "points that do not fit their lattice");
  }
  if (points % 64 != 0 && (volume.alive.back() >> (points % 64)) != 0) {
    return corrupt(chunk.payload_offset, "alive bits past the last point");
  }
  return volume;
}

Result<void> readPlainInputs(const Chunk& chunk, Recording& recording) {
  wire::ByteReader in(chunk.payload);
  const std::uint32_t count = in.u32();
  if (count == 0 || in.left() != std::uint64_t{count} * kBytesPerPlainInput + 16) {
    return corrupt(chunk.payload_offset, "inputs of the wrong length");
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    session::Input input;
    input.t_us = in.u64(), input.tip_mm = in.vec3(), input.axis = in.vec3();
    const std::uint8_t flags = in.u8();
    if (flags > 1) return corrupt(chunk.payload_offset + in.offset() - 1, "reserved flags");
    input.spinning = flags == 1;
    recording.inputs.push_back(input);
  }
  const std::uint64_t cycle = in.u64();
  recording.checkpoints.push_back({cycle, in.u64(), recording.inputs.size(), {}});
  return {};
}

bool readDiscs(wire::ByteReader& in, int discs, std::vector<DiscSum>& sums) {
  const std::uint64_t count = takeVarint(in), all = static_cast<std::uint64_t>(discs);
  if (count > all) return false;
  std::uint64_t next = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t gap = takeVarint(in);
    if (gap >= all - next) return false;
    sums.push_back({static_cast<std::uint32_t>(next + gap), in.u32()});
    next += gap + 1;
  }
  return !in.failed();
}

Result<void> readCodedInputs(const Chunk& chunk, Recording& recording) {
  wire::ByteReader in(chunk.payload);
  const std::uint32_t count = in.u32();
  if (in.failed() || count == 0 || count > kInputsPerChunk) {
    return corrupt(chunk.payload_offset, "no inputs, or too many");
  }
  Checkpoint checkpoint;
  checkpoint.cycle = in.u64(), checkpoint.state_hash = in.u64();
  if (!readDiscs(in, recording.volume.lattice.discs, checkpoint.discs)) {
    return corrupt(chunk.payload_offset + in.offset(), "discs that there are not");
  }
  const std::vector<std::uint16_t> checks = in.array<std::uint16_t>(count);
  const std::size_t code_at = chunk.payload_offset + in.offset();
  if (in.failed() || !decodeInputs(in.raw(in.left()), count, recording.inputs)) {
    return corrupt(code_at, "inputs in no known code");
  }
  recording.checks.insert(recording.checks.end(), checks.begin(), checks.end());
  checkpoint.inputs = recording.inputs.size();
  recording.checkpoints.push_back(std::move(checkpoint));
  return {};
}

/// Inputs up to the end mark or the cut.
Result<void> readRest(ChunkReader& chunks, Recording& recording) {
  for (;;) {
    const Result<std::optional<Chunk>> chunk = chunks.next();
    if (!chunk) return tl::unexpected(chunk.error());
    if (!*chunk) return {};
    const Chunk& found = **chunk;
    if (found.kind == Kind::Inputs) {
      const auto read = recording.version == 1 ? readPlainInputs(found, recording) : readCodedInputs(found, recording);
      if (!read) return read;
      continue;
    }
    if (found.kind != Kind::End) return corrupt(found.payload_offset, "a chunk out of its place");
    wire::ByteReader in(found.payload);
    if (in.u64() != recording.inputs.size() || in.failed() || in.left() != 0) {
      return corrupt(found.payload_offset, "an end mark that counts other inputs");
    }
    if (chunks.left() != 0) return corrupt(chunks.offset(), "bytes after the end mark");
    recording.complete = true;
    return {};
  }
}

Result<Chunk> expect(ChunkReader& chunks, Kind kind) {
  const std::size_t offset = chunks.offset();
  const Result<std::optional<Chunk>> chunk = chunks.next();
  if (!chunk) return tl::unexpected(chunk.error());
  if (!*chunk) return corrupt(offset, "cut before its point volume was whole,");
  if ((*chunk)->kind != kind) return corrupt(offset, "a chunk out of its place");
  return **chunk;
}

}  // namespace

Result<Recording> read(std::span<const std::byte> bytes) {
  wire::ByteReader in(bytes);
  const std::uint32_t magic = in.u32(), version = in.u32();
  if (in.failed()) return corrupt(bytes.size(), "cut before its point volume was whole,");
  if (magic != kMagic) return corrupt(0, "wrong magic number");
  if (version < kOldestVersion || version > kVersion) {
    return fail(ErrorCode::Unsupported, "recording: version " + std::to_string(version));
  }
  ChunkReader chunks(bytes, version);
  const Result<Chunk> header_chunk = expect(chunks, Kind::Header);
  if (!header_chunk) return tl::unexpected(header_chunk.error());
  const Result<Chunk> volume_chunk = expect(chunks, Kind::Volume);
  if (!volume_chunk) return tl::unexpected(volume_chunk.error());

  Recording recording;
  recording.version = version;
  Result<Header> header = readHeader(*header_chunk, version);
  if (!header) return tl::unexpected(header.error());
  recording.header = std::move(*header);
  Result<point_volume::PointVolume> volume = readVolume(*volume_chunk);
  if (!volume) return tl::unexpected(volume.error());
  recording.volume = std::move(*volume);
  if (auto ok = readRest(chunks, recording); !ok) return tl::unexpected(ok.error());
  recording.inputs.shrink_to_fit();  // of a long drill, tens of megabytes
  return recording;
}

}  // namespace spinaltap::recording
