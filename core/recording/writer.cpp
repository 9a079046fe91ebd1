#include <algorithm>
#include <cassert>
#include <utility>

#include "core/recording/disc_sums.h"
#include "core/recording/format.h"
#include "core/recording/input_code.h"
#include "core/recording/recording.h"

namespace spinaltap::recording {
namespace {

std::size_t countRuns(const auto& values) {
  std::size_t runs = 0;
  for (std::size_t i = 0; i < values.size(); ++i) runs += i == 0 || values[i] != values[i - 1];
  return runs;
}

template <class T>
void writeColumn(wire::ByteWriter& out, const std::vector<T>& values) {
  const std::size_t runs = countRuns(values);
  if (4 + runs * (4 + sizeof(T)) >= values.size() * sizeof(T)) {
    out.u8(static_cast<std::uint8_t>(ColumnForm::Plain));
    out.array(std::span<const T>(values));
    return;
  }
  out.u8(static_cast<std::uint8_t>(ColumnForm::Runs));
  out.u32(static_cast<std::uint32_t>(runs));
  for (std::size_t begin = 0; begin < values.size();) {
    std::size_t end = begin + 1;
    while (end < values.size() && values[end] == values[begin]) ++end;
    out.u32(static_cast<std::uint32_t>(end - begin));
    out.array(std::span<const T>(&values[begin], 1));
    begin = end;
  }
}

Result<void> checkHeader(const Header& header) {
  for (const std::string* text :
       {&header.core_version, &header.case_id, &header.path_id, &header.scene, &header.config.engine}) {
    if (text->size() > kMaxTextBytes) return fail(ErrorCode::Limit, "recording: a header text over 4096 bytes");
  }
  return {};
}

std::vector<std::byte> headerPayload(const Header& header) {
  wire::ByteWriter out;
  for (const std::string* text :
       {&header.core_version, &header.case_id, &header.path_id, &header.scene, &header.config.engine}) {
    out.text(*text);
  }
  const plan::Bit& bit = header.config.bit;
  out.f64(bit.diameter_mm), out.f64(bit.cone_length_mm), out.f64(bit.length_mm);
  out.f64(header.config.speed_rpm);
  const haptics::Coupling coupling = header.config.coupling.value_or(haptics::Coupling{0, 0});
  out.f64(coupling.stiffness_N_mm), out.f64(coupling.damping_N_s_mm);
  return out.take();
}

std::vector<std::byte> volumePayload(const point_volume::PointVolume& volume) {
  wire::ByteWriter out;
  out.f64(volume.lattice.spacing_mm);
  out.i32(volume.lattice.rings), out.i32(volume.lattice.discs), out.i32(volume.lattice.first_disc);
  writeColumn(out, volume.alive);
  writeColumn(out, volume.density_mg_cm3);
  return out.take();
}

}  // namespace

struct Writer::State {
  Sink sink;
  std::uint64_t previous = preambleOf(kVersion);
  std::vector<session::Input> inputs;  ///< a few that are written, to code the others from; then those that wait
  std::size_t written = 0;             ///< of `inputs`
  std::vector<std::uint16_t> checks;   ///< of those that wait
  DiscSums removed;
  std::uint64_t total = 0;
  Checkpoint checkpoint;
  bool failed = false, finished = false;

  Result<void> put(std::span<const std::byte> bytes) {
    // After a failure nothing more is written: what was kept stays a clean beginning.
    if (!failed && !sink(bytes)) failed = true;
    if (failed) return fail(ErrorCode::Io, "recording: the bytes could not be kept");
    return {};
  }

  Result<void> putChunk(Kind kind, std::span<const std::byte> payload) {
    const auto size = static_cast<std::uint32_t>(payload.size());
    wire::ByteWriter out;
    out.reserve(kChunkHeadBytes + payload.size() + kChunkTailBytes);
    out.u8(static_cast<std::uint8_t>(kind)), out.u32(size);
    out.u32(static_cast<std::uint32_t>(headHash(previous, kind, size)));
    out.raw(payload);
    previous = checksum(previous, kind, payload);
    out.u64(previous);
    return put(out.bytes());
  }

  Result<void> putInputs() {
    if (checks.empty()) return {};
    wire::ByteWriter out;
    out.u32(static_cast<std::uint32_t>(checks.size()));
    out.u64(checkpoint.cycle), out.u64(checkpoint.state_hash);
    putDiscs(removed.take(), out);
    out.array(std::span<const std::uint16_t>(checks));
    const std::span<const session::Input> all(inputs);
    encodeInputs(all.first(written), all.subspan(written), out);
    const std::size_t needless = inputs.size() - std::min(inputs.size(), kCodeMemory);
    inputs.erase(inputs.begin(), inputs.begin() + static_cast<std::ptrdiff_t>(needless));
    written = inputs.size();
    checks.clear();
    return putChunk(Kind::Inputs, out.bytes());
  }

  static void putDiscs(const std::vector<DiscSum>& discs, wire::ByteWriter& out) {
    putVarint(out, static_cast<std::uint32_t>(discs.size()));
    std::uint32_t next = 0;
    for (const DiscSum& disc : discs) {
      putVarint(out, disc.disc - next);
      out.u32(disc.sum);
      next = disc.disc + 1;
    }
  }
};

Writer::Writer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<Writer> Writer::begin(const Header& header, const point_volume::PointVolume& volume, Sink sink) {
  if (auto ok = checkHeader(header); !ok) return tl::unexpected(ok.error());
  if (volume.lattice.points() > kMaxPoints) {
    return fail(ErrorCode::Limit, "recording: more than " + std::to_string(kMaxPoints) + " points");
  }
  auto state = std::make_unique<State>();
  state->sink = std::move(sink);
  wire::ByteWriter preamble;
  preamble.u64(preambleOf(kVersion));
  if (auto ok = state->put(preamble.bytes()); !ok) return tl::unexpected(ok.error());
  if (auto ok = state->putChunk(Kind::Header, headerPayload(header)); !ok) return tl::unexpected(ok.error());
  if (auto ok = state->putChunk(Kind::Volume, volumePayload(volume)); !ok) return tl::unexpected(ok.error());
  return Writer(std::move(state));
}

Result<void> Writer::append(const session::Input& input, const session::Output& output,
                            std::span<const std::uint32_t> removed, const point_volume::PointVolume& volume) {
  State& state = *state_;
  assert(!state.finished);
  state.inputs.push_back(input);
  state.checks.push_back(static_cast<std::uint16_t>(output.state_hash));
  state.removed.add(removed, output.cycle, volume);
  state.checkpoint.cycle = output.cycle, state.checkpoint.state_hash = output.state_hash;
  ++state.total;
  if (state.checks.size() < kInputsPerChunk) return {};
  return state.putInputs();
}

Result<void> Writer::flush() { return state_->putInputs(); }

Result<void> Writer::finish() {
  assert(!state_->finished);
  if (auto ok = state_->putInputs(); !ok) return ok;
  wire::ByteWriter out;
  out.u64(state_->total);
  state_->finished = true;
  return state_->putChunk(Kind::End, out.bytes());
}

}  // namespace spinaltap::recording
