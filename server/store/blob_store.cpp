#include "server/store/blob_store.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "server/store/ids.h"

namespace spinaltap::store {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kWriteChunk = 1 << 20;

Error ioError(std::string_view step) {
  return {ErrorCode::Io, "data folder: " + std::string(step) + " failed: " + std::strerror(errno)};
}

class File {
 public:
  explicit File(int handle) : handle_(handle) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (handle_ >= 0) ::close(handle_);
  }
  [[nodiscard]] int handle() const { return handle_; }

 private:
  int handle_;
};

bool syncFolder(const fs::path& folder) {
  const File file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return file.handle() >= 0 && ::fsync(file.handle()) == 0;
}

std::string hex(std::span<const unsigned char> bytes) {
  std::string out(bytes.size() * 2 + 1, '\0');
  sodium_bin2hex(out.data(), out.size(), bytes.data(), bytes.size());
  out.pop_back();
  return out;
}

void sweep(const fs::path& folder) {
  std::error_code ignored;
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(24);
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (fs::last_write_time(entry.path(), ignored) < old) fs::remove(entry.path(), ignored);
  }
}

}  // namespace

bool writeAll(int handle, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(handle, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return true;
}

bool isBlobId(std::string_view id) {
  return id.size() == 64 && id.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

BlobId blobIdOf(std::span<const std::byte> bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> hash{};
  crypto_hash_sha256(hash.data(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  return hex(hash);
}

Result<BlobStore> BlobStore::open(fs::path folder, Fault fault) {
  std::error_code error;
  fs::create_directories(folder / "tmp", error);
  if (error) return fail(ErrorCode::Io, "data folder: cannot make its folder for blobs: " + error.message());
  sweep(folder / "tmp");
  return BlobStore(std::move(folder), std::move(fault));
}

fs::path BlobStore::place(const BlobId& id) const { return folder_ / id.substr(0, 2) / id; }

Result<void> BlobStore::moveIn(const fs::path& from, const fs::path& to) {
  std::error_code error;
  const bool made = fs::create_directories(to.parent_path(), error);
  if (error) return fail(ErrorCode::Io, "data folder: cannot make a folder for a blob: " + error.message());
  if (faulty("rename") || ::rename(from.c_str(), to.c_str()) != 0) return tl::unexpected(ioError("renaming a blob"));
  if (faulty("fsync folder") || !syncFolder(to.parent_path()) || (made && !syncFolder(folder_))) {
    return tl::unexpected(ioError("syncing a folder of blobs"));
  }
  return {};
}

Result<void> BlobStore::write(const fs::path& to, std::span<const std::byte> bytes) {
  const fs::path temporary = folder_ / "tmp" / randomId('b', 16);
  const auto writeTemporary = [&]() -> Result<void> {
    const File file(faulty("open") ? -1 : ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640));
    if (file.handle() < 0) return tl::unexpected(ioError("opening a new blob"));
    for (std::size_t at = 0; at < bytes.size(); at += kWriteChunk) {
      const auto chunk = bytes.subspan(at, std::min(kWriteChunk, bytes.size() - at));
      if (faulty("write") || !writeAll(file.handle(), chunk)) return tl::unexpected(ioError("writing a blob"));
    }
    if (faulty("fsync") || ::fsync(file.handle()) != 0) return tl::unexpected(ioError("syncing a blob"));
    return {};
  };
  Result<void> result = writeTemporary();
  if (result) result = moveIn(temporary, to);
  if (!result) ::unlink(temporary.c_str());
  return result;
}

Result<BlobId> BlobStore::put(std::span<const std::byte> bytes, Gzip wanted) {
  BlobId id = blobIdOf(bytes);
  const fs::path to = place(id);
  std::error_code error;
  if (fs::file_size(to, error) != bytes.size() || error) {
    if (const auto written = write(to, bytes); !written) return tl::unexpected(written.error());
  }
  if (wanted == Gzip::Sibling && gzipFile(id).empty()) {
    if (const auto written = write(to.string() + ".gz", gzip(bytes)); !written) return tl::unexpected(written.error());
  }
  return id;
}

Result<BlobId> BlobStore::adopt(const fs::path& from) {
  const File file(::open(from.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.handle() < 0) return fail(ErrorCode::NotFound, "data folder: the file to keep is not there");
  crypto_hash_sha256_state state;
  crypto_hash_sha256_init(&state);
  std::vector<unsigned char> buffer(kWriteChunk);
  for (;;) {
    const ssize_t n = ::read(file.handle(), buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(ioError("reading the file to keep"));
    if (n == 0) break;
    crypto_hash_sha256_update(&state, buffer.data(), static_cast<std::size_t>(n));
  }
  std::array<unsigned char, crypto_hash_sha256_BYTES> hash{};
  crypto_hash_sha256_final(&state, hash.data());
  if (faulty("fsync") || ::fsync(file.handle()) != 0) return tl::unexpected(ioError("syncing the file to keep"));
  BlobId id = hex(hash);
  if (const auto moved = moveIn(from, place(id)); !moved) return tl::unexpected(moved.error());
  return id;
}

void BlobStore::remove(const BlobId& id) {
  if (!isBlobId(id)) return;
  std::error_code ignored;
  fs::remove(place(id).string() + ".gz", ignored);
  fs::remove(place(id), ignored);
}

Result<fs::path> BlobStore::file(const BlobId& id) const {
  std::error_code error;
  if (!isBlobId(id) || !fs::is_regular_file(place(id), error)) {
    return fail(ErrorCode::NotFound, "data folder: blob " + id.substr(0, 12) + " is not there");
  }
  return place(id);
}

fs::path BlobStore::gzipFile(const BlobId& id) const {
  if (!isBlobId(id)) return {};
  fs::path sibling = place(id).string() + ".gz";
  std::error_code error;
  return fs::is_regular_file(sibling, error) ? sibling : fs::path{};
}

Result<std::vector<std::byte>> BlobStore::get(const BlobId& id) const {
  const auto path = file(id);
  if (!path) return tl::unexpected(path.error());
  auto bytes = readFile(*path);
  if (bytes && blobIdOf(*bytes) != id) {
    return fail(ErrorCode::Corrupt, "data folder: blob " + id.substr(0, 12) + " no longer matches its name");
  }
  return bytes;
}

Result<std::vector<std::byte>> readFile(const fs::path& path, std::size_t limit) {
  const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info{};
  if (file.handle() < 0 || ::fstat(file.handle(), &info) != 0) {
    return fail(errno == ENOENT ? ErrorCode::NotFound : ErrorCode::Io,
                "cannot open " + path.filename().string() + ": " + std::strerror(errno));
  }
  if (!S_ISREG(info.st_mode)) return fail(ErrorCode::Io, path.filename().string() + " is not a file");
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size > limit) return fail(ErrorCode::Limit, path.filename().string() + " is too large");
  std::vector<std::byte> bytes(size);
  std::size_t at = 0;
  while (at < size) {
    const ssize_t n = ::read(file.handle(), bytes.data() + at, size - at);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return fail(ErrorCode::Io, "cannot read " + path.filename().string() + ": " + std::strerror(errno));
    if (n == 0) break;
    at += static_cast<std::size_t>(n);
  }
  bytes.resize(at);
  return bytes;
}

Result<void> replaceFile(const fs::path& path, std::span<const std::byte> bytes) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const fs::path temporary = folder / (path.filename().string() + "." + randomId('t', 8));
  const auto failed = [&](const char* step) -> Result<void> {
    const int cause = errno;
    ::unlink(temporary.c_str());
    return fail(ErrorCode::Io,
                std::string("cannot ") + step + " " + path.filename().string() + ": " + std::strerror(cause));
  };
  const File file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (file.handle() < 0 || !writeAll(file.handle(), bytes) || ::fsync(file.handle()) != 0) return failed("write");
  if (::rename(temporary.c_str(), path.c_str()) != 0 || !syncFolder(folder)) return failed("put in place");
  return {};
}

std::vector<std::byte> gzip(std::span<const std::byte> bytes) {
  z_stream stream{};
  constexpr int kGzipWindow = 15 + 16;  // zlib's way to ask for a gzip header
  constexpr int kLevel = 3;             // a CT is no larger than with 6, in a third of the time: noise is what it holds
  deflateInit2(&stream, kLevel, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY);
  std::vector<std::byte> out(deflateBound(&stream, bytes.size()));
  // zlib counts in 32 bits: feed it in pieces
  std::size_t in_at = 0, out_at = 0;
  int state = Z_OK;
  while (state == Z_OK) {
    const std::size_t in = std::min<std::size_t>(bytes.size() - in_at, 1u << 30);
    const std::size_t room = std::min<std::size_t>(out.size() - out_at, 1u << 30);
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data() + in_at));
    stream.avail_in = static_cast<uInt>(in);
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + out_at);
    stream.avail_out = static_cast<uInt>(room);
    state = deflate(&stream, in_at + in == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    in_at += in - stream.avail_in;
    out_at += room - stream.avail_out;
  }
  deflateEnd(&stream);
  out.resize(out_at);
  return out;
}

}  // namespace spinaltap::store
