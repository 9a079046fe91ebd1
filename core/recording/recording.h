// core/recording/recording.h - everything needed to re-run a drill session bit for bit, as bytes.
// Layout: core/recording/FORMAT.md (normative).
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/recording/disc_sums.h"
#include "core/session/session.h"

namespace spinaltap::recording {

/// What the session started from. The point volume is embedded, so a recording needs nothing else to be replayed.
struct Header {
  std::string core_version;
  std::string case_id, path_id;  ///< empty for scenes
  std::string scene;             ///< empty for cases
  session::Config config;
};

/// The state after a cycle, for comparison.
struct Checkpoint {
  std::uint64_t cycle = 0;  ///< 1-based, as session::Output::cycle
  std::uint64_t state_hash = 0;
  std::uint64_t inputs = 0;    ///< how many led here, refused ones included
  std::vector<DiscSum> discs;  ///< what was removed since the checkpoint before; none in version 1
};

struct Recording {
  std::uint32_t version = 3;  ///< of the format
  Header header;
  point_volume::PointVolume volume;    ///< as it was before the first input
  std::vector<session::Input> inputs;  ///< as they arrived, refused ones included
  std::vector<std::uint16_t> checks;   ///< the low bits of the state hash after each input; none in version 1
  std::vector<Checkpoint> checkpoints;
  bool complete = false;  ///< false when the tail was cut off: everything up to the cut is here
};

/// Receives bytes in order; returns false when they could not be kept.
using Sink = std::function<bool(std::span<const std::byte>)>;

/// Append-only; each chunk carries its own checksum, so a cut loses at most the last chunk.
class Writer {
 public:
  /// @error Io, when the sink refuses the header; Limit, over 2^26 points or 4096 bytes a text.
  [[nodiscard]] static Result<Writer> begin(const Header& header, const point_volume::PointVolume& volume, Sink sink);
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  ~Writer();

  /// Buffers; writes a chunk every 1000 inputs. `removed` are the points that the step removed, `volume` is the
  /// session's after it. @error Io; from then on nothing more is written, and every call fails.
  [[nodiscard]] Result<void> append(const session::Input& input, const session::Output& output,
                                    std::span<const std::uint32_t> removed, const point_volume::PointVolume& volume);
  /// Writes what is buffered, so that it survives a crash. @error Io.
  [[nodiscard]] Result<void> flush();
  /// The last chunk and the end mark. @error Io.
  [[nodiscard]] Result<void> finish();

 private:
  struct State;
  explicit Writer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Reads versions 1 to 3. @error Corrupt (naming the offset), Unsupported (another version), Limit. A cut tail is no
/// error: complete = false, with
///        everything before the cut; but when not even the point volume is whole there is nothing to replay: Corrupt.
[[nodiscard]] Result<Recording> read(std::span<const std::byte> bytes);

struct ReplayReport {
  /// Every checkpoint met, and at least one. In version 2 by the cycles and the points removed: its hashes hold a force
  /// that today's core does not reckon.
  bool verified = false;
  /// False: version 1, and its hashes differ. Cores before 0.2 hashed otherwise, so that says nothing about the drill.
  bool comparable = true;
  std::uint64_t cycles = 0;
  std::uint64_t state_hash = 0;  ///< after the last input
  /// The first cycle after which the states differ; 0 when none does. (One wrong state in 2^16 passes for right, and
  /// then it is a later one. Version 1: the cycle of the first checkpoint that differs.)
  std::uint64_t first_difference = 0;
  /// The discs on which, from there to the first checkpoint that shows any, other points were removed, or the same at
  /// other cycles, with other densities or beside others. None when force or time alone differ, and in version 1.
  std::vector<std::uint32_t> discs;
};

/// One line for people: verified, or the cycle and the discs that differ first, or why nothing can be said.
[[nodiscard]] std::string describe(const ReplayReport& report);

/// each(input, output, removed), refused inputs included; the indices removed are valid during the call.
using Observer =
    std::function<void(const session::Input&, const session::Output&, std::span<const std::uint32_t> removed)>;

/// Runs the inputs through a fresh session. progress(fraction) and each may be empty.
/// @error as session::Session::create.
[[nodiscard]] Result<ReplayReport> replay(const Recording& recording, const std::function<void(double)>& progress = {},
                                          const Observer& each = {});

}  // namespace spinaltap::recording
