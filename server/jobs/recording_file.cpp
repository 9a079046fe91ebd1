#include "server/jobs/recording_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "server/store/blob_store.h"
#include "server/store/ids.h"

namespace spinaltap::jobs {
namespace fs = std::filesystem;
namespace {

constexpr auto kFlushEvery = std::chrono::seconds(1);

/// The open file, which what waits for the disk keeps alive.
struct File {
  int handle = -1;
  Disk disk;
  bool elsewhere = false;  ///< append() is running: nothing may block
  std::atomic<std::size_t> waiting = 0;
  std::atomic<bool> failed = false;

  File() = default;
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (handle >= 0) ::close(handle);  // also gives the lock back
  }
};

bool write(const std::shared_ptr<File>& file, std::span<const std::byte> bytes) {
  if (file->failed) return false;
  if (!file->elsewhere) return store::writeAll(file->handle, bytes);
  if (file->waiting > RecordingFile::kMostWaitingBytes) return false;
  file->waiting += bytes.size();
  file->disk([file, kept = std::vector<std::byte>(bytes.begin(), bytes.end())] {
    if (!store::writeAll(file->handle, kept)) file->failed = true;
    file->waiting -= kept.size();
  });
  return true;
}

void sync(const std::shared_ptr<File>& file) {
  if (file->elsewhere) {
    file->disk([file] { ::fdatasync(file->handle); });
  } else {
    ::fdatasync(file->handle);
  }
}

}  // namespace

struct RecordingFile::State {
  store::Store& store;
  std::string id, case_id, path_id;
  fs::path path;
  std::shared_ptr<File> file = std::make_shared<File>();
  std::uint64_t cycles = 0;
  std::chrono::steady_clock::time_point flushed = std::chrono::steady_clock::now();
  std::unique_ptr<recording::Writer> writer;  ///< never null once begin() has returned

  State(store::Store& where, const recording::Header& header)
      : store(where), id(store::randomId('r')), case_id(header.case_id), path_id(header.path_id) {
    path = store.folder() / "live" / (id + ".rec");
  }
};

RecordingFile::RecordingFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingFile::RecordingFile(RecordingFile&&) noexcept = default;
RecordingFile& RecordingFile::operator=(RecordingFile&&) noexcept = default;
RecordingFile::~RecordingFile() = default;

const std::string& RecordingFile::id() const { return state_->id; }

Result<RecordingFile> RecordingFile::begin(store::Store& store, const recording::Header& header,
                                           const point_volume::PointVolume& volume, Disk disk) {
  auto state = std::make_unique<State>(store, header);
  File& file = *state->file;
  file.handle = ::open(state->path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (file.handle < 0 || ::flock(file.handle, LOCK_EX | LOCK_NB) != 0) {
    return fail(ErrorCode::Io, std::string("data folder: cannot begin a recording: ") + std::strerror(errno));
  }
  auto writer = recording::Writer::begin(
      header, volume, [to = state->file](std::span<const std::byte> bytes) { return write(to, bytes); });
  if (!writer) {
    ::unlink(state->path.c_str());
    return tl::unexpected(writer.error());
  }
  file.elsewhere = static_cast<bool>(disk);
  file.disk = std::move(disk);
  state->writer = std::make_unique<recording::Writer>(std::move(*writer));
  return RecordingFile(std::move(state));
}

Result<void> RecordingFile::append(const session::Input& input, const session::Output& output,
                                   std::span<const std::uint32_t> removed, const point_volume::PointVolume& volume) {
  if (output.status == session::Status::Ok) state_->cycles = output.cycle;
  auto appended = state_->writer->append(input, output, removed, volume);
  if (!appended && state_->file->waiting > kMostWaitingBytes) {
    return fail(ErrorCode::Limit, "recording: the disk does not keep up");
  }
  if (!appended) return appended;
  const auto now = std::chrono::steady_clock::now();
  if (now - state_->flushed < kFlushEvery) return {};
  state_->flushed = now;
  auto flushed = state_->writer->flush();
  sync(state_->file);
  return flushed;
}

std::size_t RecordingFile::waitingBytes() const { return state_->file->waiting; }

Result<store::Recording> RecordingFile::keep(bool complete, const std::string& metrics_json) {
  State& state = *state_;
  state.file->elsewhere = false;
  if (state.file->failed) return fail(ErrorCode::Io, "data folder: a recording could not be written");
  // An interrupted drill ends without the end mark, so that the file itself says that it was cut off.
  const auto ended = complete ? state.writer->finish() : state.writer->flush();
  if (!ended) return tl::unexpected(ended.error());
  const auto blob = state.store.blobs().adopt(state.path);
  if (!blob) return tl::unexpected(blob.error());
  return state.store.addRecording(
      {state.id, state.case_id, state.path_id, "", state.cycles, complete, metrics_json, *blob});
}

void RecordingFile::discard() { ::unlink(state_->path.c_str()); }

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
