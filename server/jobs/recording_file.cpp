#include "server/jobs/recording_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "server/store/blob_store.h"
#include "server/store/ids.h"

namespace spinaltap::jobs {
namespace fs = std::filesystem;
namespace {

constexpr auto kFlushEvery = std::chrono::seconds(1);

}  // namespace

struct RecordingFile::State {
  store::Store& store;
  std::string id, case_id, path_id;
  fs::path file;
  int handle = -1;
  std::uint64_t cycles = 0;
  std::chrono::steady_clock::time_point flushed = std::chrono::steady_clock::now();
  std::unique_ptr<recording::Writer> writer;  ///< never null once begin() has returned

  State(store::Store& where, const recording::Header& header)
      : store(where), id(store::randomId('r')), case_id(header.case_id), path_id(header.path_id) {
    file = store.folder() / "live" / (id + ".rec");
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (handle >= 0) ::close(handle);  // also gives the lock back
  }
};

RecordingFile::RecordingFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingFile::RecordingFile(RecordingFile&&) noexcept = default;
RecordingFile& RecordingFile::operator=(RecordingFile&&) noexcept = default;
RecordingFile::~RecordingFile() = default;

const std::string& RecordingFile::id() const { return state_->id; }

Result<RecordingFile> RecordingFile::begin(store::Store& store, const recording::Header& header,
                                           const point_volume::PointVolume& volume) {
  auto state = std::make_unique<State>(store, header);
  state->handle = ::open(state->file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (state->handle < 0 || ::flock(state->handle, LOCK_EX | LOCK_NB) != 0) {
    return fail(ErrorCode::Io, std::string("data folder: cannot begin a recording: ") + std::strerror(errno));
  }
  const int handle = state->handle;
  auto writer = recording::Writer::begin(
      header, volume, [handle](std::span<const std::byte> bytes) { return store::writeAll(handle, bytes); });
  if (!writer) {
    ::unlink(state->file.c_str());
    return tl::unexpected(writer.error());
  }
  state->writer = std::make_unique<recording::Writer>(std::move(*writer));
  return RecordingFile(std::move(state));
}

Result<void> RecordingFile::append(const session::Input& input, const session::Output& output,
                                   std::span<const std::uint32_t> removed, const point_volume::PointVolume& volume) {
  if (output.status == session::Status::Ok) state_->cycles = output.cycle;
  auto appended = state_->writer->append(input, output, removed, volume);
  if (!appended) return appended;
  const auto now = std::chrono::steady_clock::now();
  if (now - state_->flushed < kFlushEvery) return {};
  state_->flushed = now;
  auto flushed = state_->writer->flush();
  ::fdatasync(state_->handle);
  return flushed;
}

Result<store::Recording> RecordingFile::keep(bool complete, const std::string& metrics_json) {
  State& state = *state_;
  // An interrupted drill ends without the end mark, so that the file itself says that it was cut off.
  const auto ended = complete ? state.writer->finish() : state.writer->flush();
  if (!ended) return tl::unexpected(ended.error());
  const auto blob = state.store.blobs().adopt(state.file);
  if (!blob) return tl::unexpected(blob.error());
  return state.store.addRecording(
      {state.id, state.case_id, state.path_id, "", state.cycles, complete, metrics_json, *blob});
}

void RecordingFile::discard() { ::unlink(state_->file.c_str()); }

namespace {

/// Who writes holds the lock; once it is free, what is there is all there will ever be.
Result<void> recoverOne(store::Store& store, const fs::path& file) {
  const auto bytes = store::readFile(file);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto read = recording::read(*bytes);
  if (!read) return tl::unexpected(read.error());
  if (read->inputs.empty()) return fail(ErrorCode::Corrupt, "no inputs");
  // every chunk ends with a checkpoint, so the last one counts the cycles that are kept
  const std::uint64_t cycles = read->checkpoints.empty() ? 0 : read->checkpoints.back().cycle;
  const auto blob = store.blobs().put(*bytes);
  if (!blob) return tl::unexpected(blob.error());
  const auto row = store.addRecording(
      {file.stem().string(), read->header.case_id, read->header.path_id, "", cycles, read->complete, "{}", *blob});
  return row ? Result<void>{} : tl::unexpected(row.error());
}

}  // namespace

int recoverRecordings(store::Store& store) {
  int count = 0;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(store.folder() / "live", ignored)) {
    if (entry.path().extension() != ".rec") continue;
    const int handle = ::open(entry.path().c_str(), O_RDONLY | O_CLOEXEC);
    if (handle >= 0 && ::flock(handle, LOCK_EX | LOCK_NB) == 0) {
      const auto recovered = recoverOne(store, entry.path());
      count += recovered ? 1 : 0;
      // a full disk is no reason to lose a recording: it is tried again at the next start
      if (recovered || recovered.error().code != ErrorCode::Io) fs::remove(entry.path(), ignored);
    }
    if (handle >= 0) ::close(handle);
  }
  return count;
}

}  // namespace spinaltap::jobs
