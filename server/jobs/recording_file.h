// server/jobs/recording_file.h - a recording that grows on disk while somebody drills.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "core/metrics/metrics.h"
#include "core/recording/recording.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

/// Runs what it is given, one after another in order, perhaps on another thread. Empty: at once.
using Disk = std::function<void(std::function<void()>)>;

/// live/<recording id>.rec in the data folder, locked while it is written. What was flushed survives a crash of the
/// program; recoverRecordings() brings it in.
class RecordingFile {
 public:
  /// So much may wait for the disk, some minutes of drilling; then append() fails.
  static constexpr std::size_t kMostWaitingBytes = 8 << 20;

  /// Writes what the session starts from. @param disk  does what append() has to write. @error Io.
  [[nodiscard]] static Result<RecordingFile> begin(store::Store& store, const recording::Header& header,
                                                   const point_volume::PointVolume& volume, Disk disk = {});
  RecordingFile(RecordingFile&&) noexcept;
  RecordingFile& operator=(RecordingFile&&) noexcept;
  ~RecordingFile();  ///< without keep(): the file stays for recoverRecordings()

  /// As recording::Writer::append, and puts what is waiting on disk about once a second. With a disk
  /// that runs elsewhere it does not block. @error Io, Limit (the disk does not keep up).
  [[nodiscard]] Result<void> append(const session::Input& input, const session::Output& output,
                                    std::span<const std::uint32_t> removed, const point_volume::PointVolume& volume);

  /// Given to the disk, and not written yet.
  [[nodiscard]] std::size_t waitingBytes() const;

  /// Ends the file, moves it among the blobs and adds its row.
  /// @param complete  the drill was finished by its trainee, not cut off. @pre nothing waits for the disk. @error Io,
  /// NotFound.
  [[nodiscard]] Result<store::Recording> keep(bool complete, const std::string& metrics_json);
  /// Forgets the recording.
  void discard();

  [[nodiscard]] const std::string& id() const;

 private:
  struct State;
  explicit RecordingFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Brings in recordings whose writer is gone. Returns how many; files that hold nothing readable are removed.
int recoverRecordings(store::Store& store);

}  // namespace spinaltap::jobs
