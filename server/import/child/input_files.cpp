#include "server/import/child/input_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "server/import/child/output.h"

namespace spinaltap::importer {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kHeadBytes = 352;

class OpenFile {
 public:
  OpenFile(const fs::path& path, int flags) : fd_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | flags)) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (fd_ >= 0) close(fd_);
  }
  [[nodiscard]] bool good() const { return fd_ >= 0; }
  /// -1 unless it is a regular file.
  [[nodiscard]] std::int64_t size() const {
    struct stat status{};
    if (fstat(fd_, &status) != 0 || !S_ISREG(status.st_mode)) return -1;
    return status.st_size;
  }
  /// Appends up to `count` bytes; false on a read error.
  [[nodiscard]] bool append(std::string& out, std::size_t count) const {
    const std::size_t before = out.size();
    out.resize(before + count);
    std::size_t got = 0;
    while (got < count) {
      const ssize_t n = read(fd_, out.data() + before + got, count - got);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return false;
      if (n == 0) break;
      got += static_cast<std::size_t>(n);
    }
    out.resize(before + got);
    return true;
  }

 private:
  int fd_;
};

std::string safeName(const fs::path& path) { return oneLine(path.filename().native(), 120); }

enum class Wanted { Anything, OnlyDicom };

struct ReadState {
  const ImportLimits& limits;
  std::uint64_t total_bytes = 0;
};

/// Empty when it is skipped.
Result<std::vector<InputFile>> readFile(const fs::path& path, Wanted wanted, int flags, ReadState& state) {
  InputFile file{safeName(path), {}};
  const OpenFile source(path, flags);
  if (!source.good()) {
    if (errno == ENOENT) return fail(ErrorCode::NotFound, file.name + ": no such file or folder");
    return fail(ErrorCode::Io, file.name + ": cannot be opened");
  }
  const std::int64_t size = source.size();
  if (size < 0) return fail(ErrorCode::Unsupported, file.name + ": not a regular file");
  if (!source.append(file.bytes, std::min<std::size_t>(kHeadBytes, static_cast<std::size_t>(size)))) {
    return fail(ErrorCode::Io, file.name + ": cannot be read");
  }
  if (wanted == Wanted::OnlyDicom && !beginsLikeDicom(file.bytes)) return std::vector<InputFile>{};
  state.total_bytes += static_cast<std::uint64_t>(size);
  if (state.total_bytes > state.limits.input_bytes) {
    return fail(ErrorCode::Limit,
                file.name + ": the input is larger than " + std::to_string(state.limits.input_bytes >> 20) + " MiB");
  }
  if (!source.append(file.bytes, static_cast<std::size_t>(size) - file.bytes.size())) {
    return fail(ErrorCode::Io, file.name + ": cannot be read");
  }
  std::vector<InputFile> one;
  one.push_back(std::move(file));
  return one;
}

struct Listing {
  std::vector<fs::path> files;
  std::vector<std::string> skipped_links;
};

Result<Listing> listFolder(const fs::path& folder, const ImportLimits& limits) {
  constexpr int kDeepest = 8;
  Listing listing;
  std::error_code error;
  auto it = fs::recursive_directory_iterator(folder, fs::directory_options::none, error);
  std::size_t seen = 0;
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (++seen > limits.files) {
      return fail(ErrorCode::Limit, "the folder holds more than " + std::to_string(limits.files) + " files");
    }
    if (it.depth() > kDeepest) return fail(ErrorCode::Limit, "the folder nests deeper than 8 levels");
    const fs::file_status status = it->symlink_status(error);
    if (error) break;
    if (status.type() == fs::file_type::symlink) listing.skipped_links.push_back(safeName(it->path()));
    if (status.type() == fs::file_type::regular) listing.files.push_back(it->path());
  }
  if (error) return fail(ErrorCode::Io, "the folder cannot be listed");
  std::sort(listing.files.begin(), listing.files.end());
  return listing;
}

/// "notes.txt, Thumbs.db and 7 more".
std::string nameSome(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 4;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kShown); ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kShown) text += " and " + std::to_string(names.size() - kShown) + " more";
  return text;
}

Result<Input> readFolder(const ImportRequest& request, ReadState& state) {
  auto listing = listFolder(request.from, request.limits);
  if (!listing) return tl::unexpected(listing.error());
  Input input;
  input.folder = true;
  std::vector<std::string> skipped;
  for (std::size_t i = 0; i < listing->files.size(); ++i) {
    const fs::path& path = listing->files[i];
    auto file = readFile(path, Wanted::OnlyDicom, O_NOFOLLOW, state);
    if (!file) return tl::unexpected(file.error());
    if (file->empty()) skipped.push_back(safeName(path));
    for (InputFile& one : *file) input.files.push_back(std::move(one));
    reportProgress("read", i + 1, listing->files.size());
  }
  if (!skipped.empty()) input.notes.push_back("skipped, not DICOM: " + nameSome(skipped));
  if (!listing->skipped_links.empty()) {
    input.notes.push_back("skipped, links are not followed: " + nameSome(listing->skipped_links));
  }
  if (input.files.empty()) {
    return fail(ErrorCode::Unsupported, "the folder holds no DICOM file (a NIfTI file is given by its own name)");
  }
  return input;
}

Result<Input> readOne(const ImportRequest& request, ReadState& state) {
  auto file = readFile(request.from, Wanted::Anything, 0, state);
  if (!file) return tl::unexpected(file.error());
  Input input;
  input.files = std::move(*file);
  if (input.files.front().bytes.empty()) return fail(ErrorCode::Corrupt, input.files.front().name + ": empty file");
  if (beginsLikeNifti(input.files.front().bytes)) input.kind = InputKind::Nifti;
  return input;
}

}  // namespace

bool beginsLikeDicom(std::string_view head) {
  if (head.size() >= 132 && head.substr(128, 4) == "DICM") return true;
  if (head.size() < 8) return false;
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(head[i]); };
  const bool little = (at(0) == 2 || at(0) == 8) && at(1) == 0 && at(3) == 0;
  const bool big = at(0) == 0 && (at(1) == 2 || at(1) == 8) && at(2) == 0;
  return little || big;
}

bool beginsLikeNifti(std::string_view head) {
  if (head.size() >= 2 && head.substr(0, 2) == "\x1f\x8b") return true;
  const bool one = head.size() >= 348 && (head.substr(344, 3) == "n+1" || head.substr(344, 3) == "ni1");
  const bool two = head.size() >= 8 && (head.substr(4, 3) == "n+2" || head.substr(4, 3) == "ni2");
  return one || two;
}

Result<Input> readInput(const ImportRequest& request) {
  ReadState state{request.limits};
  std::error_code error;
  const bool folder = fs::is_directory(request.from, error);
  auto input = folder ? readFolder(request, state) : readOne(request, state);
  if (!input) return input;
  if (request.label) {
    auto label = readFile(request.label->file, Wanted::Anything, 0, state);
    if (!label) return tl::unexpected(label.error());
    input->label = std::move(*label);
  }
  input->total_bytes = state.total_bytes;
  return input;
}

}  // namespace spinaltap::importer
