// server/ws/live_drill.h - the one truth of a drill: the authoritative session, its recording and its metrics. Knows no
// connection; whoever drives may come and go.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/wire/drill_messages.h"
#include "server/jobs/recording_file.h"
#include "server/store/store.h"
#include "server/ws/waiting_room.h"

namespace spinaltap::ws {

/// Ten hours at 1 kHz: no trainee drills longer, and a recording stays below 2.1 GB.
inline constexpr std::uint64_t kMostInputs = 36'000'000;
/// Cycles from one state hash on the wire to the next.
inline constexpr std::uint32_t kHashEvery = 16;

/// Between a hand on this device and the bit: as stiff as asked for, as the default, and as the device can hold.
[[nodiscard]] std::optional<haptics::Coupling> couplingFor(const wire::Hello& hello);
/// Of force and torque, so that what vertebral drilling reaches is what the device reaches.
[[nodiscard]] double forceScaleFor(const wire::Hello& hello);

class LiveDrill {
 public:
  /// Reads the case's files and begins the recording: tens of milliseconds, and blocks.
  /// @param disk  runs what writes the recording, in order; see jobs::RecordingFile.
  /// @error NotFound, Corrupt, Io; InvalidArgument.
  [[nodiscard]] static Result<std::unique_ptr<LiveDrill>> open(store::Store& store, const Ticket& ticket,
                                                               const wire::Hello& hello, const jobs::Disk& disk);
  LiveDrill(const LiveDrill&) = delete;
  LiveDrill& operator=(const LiveDrill&) = delete;
  ~LiveDrill();

  /// Who drives from now on: what the device can bear.
  void setDevice(const wire::Hello& hello);
  /// All but the token and whether the loop is in real time.
  [[nodiscard]] wire::Welcome welcome() const;

  /// Whether the batch may be drilled now. @error InvalidArgument: another sequence number comes next; Limit: the
  /// drill is too long.
  [[nodiscard]] Result<void> accept(const wire::Poses& batch);
  /// Drills poses `from` .. `to` - 1 of a batch that was accepted; adds them to what `feedback` answers.
  /// @error Io.
  [[nodiscard]] Result<void> drill(const wire::Poses& batch, std::size_t from, std::size_t to,
                                   wire::Feedback& feedback);
  /// Bytes of the recording that are not on disk yet.
  [[nodiscard]] std::size_t waitingBytes() const;

  struct Kept {
    std::string recording_id;  ///< empty when nothing was drilled, or it could not be kept
    std::string metrics_json = "{}";
    bool failed = false;
  };
  /// Ends the drill. Blocks: measures the hole and moves the recording among the blobs.
  /// @pre runs where `disk` runs, so that all was written before.
  [[nodiscard]] Kept keep(bool complete);

 private:
  struct State;
  explicit LiveDrill(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spinaltap::ws
