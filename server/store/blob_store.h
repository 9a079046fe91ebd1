// server/store/blob_store.h - large immutable bytes, named by their SHA-256: blobs/ab/<64 hex digits>.
// A blob appears whole or not at all: written to blobs/tmp under another name, fsynced, renamed, its folder fsynced.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace spinaltap::store {

using BlobId = std::string;  ///< 64 lower-case hex digits; empty means there is none

[[nodiscard]] bool isBlobId(std::string_view id);
[[nodiscard]] BlobId blobIdOf(std::span<const std::byte> bytes);

/// Every byte, past interruptions and short writes; false when the system refuses (errno says why).
[[nodiscard]] bool writeAll(int handle, std::span<const std::byte> bytes);

/// Called before each step of a write ("open", "write", "fsync", "rename", "fsync folder"); true makes the step fail.
/// For tests only.
using Fault = std::function<bool(std::string_view step)>;

enum class Gzip { No, Sibling };  ///< Sibling: also keep <name>.gz, for bodies that browsers download

/// Any number of processes and threads may use one folder.
class BlobStore {
 public:
  /// Makes the folder when it is not there and sweeps temporary files older than a day. @error Io.
  [[nodiscard]] static Result<BlobStore> open(std::filesystem::path folder, Fault fault = {});

  /// @error Io. A blob that is already there is not written again.
  [[nodiscard]] Result<BlobId> put(std::span<const std::byte> bytes, Gzip gzip = Gzip::No);
  /// Moves a finished file of the same file system in. @error Io, NotFound.
  [[nodiscard]] Result<BlobId> adopt(const std::filesystem::path& file);

  /// @error NotFound, Io, Corrupt (the bytes no longer match the name).
  [[nodiscard]] Result<std::vector<std::byte>> get(const BlobId& id) const;

  /// Also its sibling. A blob that is not there is no error.
  void remove(const BlobId& id);

  /// Where the bytes are. @error NotFound.
  [[nodiscard]] Result<std::filesystem::path> file(const BlobId& id) const;
  /// The gzipped sibling's place; empty when there is none.
  [[nodiscard]] std::filesystem::path gzipFile(const BlobId& id) const;

 private:
  BlobStore(std::filesystem::path folder, Fault fault) : folder_(std::move(folder)), fault_(std::move(fault)) {}
  [[nodiscard]] std::filesystem::path place(const BlobId& id) const;
  [[nodiscard]] Result<void> write(const std::filesystem::path& to, std::span<const std::byte> bytes);
  [[nodiscard]] Result<void> moveIn(const std::filesystem::path& from, const std::filesystem::path& to);
  [[nodiscard]] bool faulty(std::string_view step) const { return fault_ && fault_(step); }

  std::filesystem::path folder_;
  Fault fault_;
};

/// The whole of a file. @error NotFound, Io, Limit (over `limit` bytes).
[[nodiscard]] Result<std::vector<std::byte>> readFile(const std::filesystem::path& file, std::size_t limit = SIZE_MAX);

/// Replaces `file` whole or not at all: temporary name, fsync, rename. @error Io.
[[nodiscard]] Result<void> replaceFile(const std::filesystem::path& file, std::span<const std::byte> bytes);

[[nodiscard]] std::vector<std::byte> gzip(std::span<const std::byte> bytes);

}  // namespace spinaltap::store
