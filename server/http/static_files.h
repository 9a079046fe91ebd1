// server/http/static_files.h - the built pages.
#pragma once
#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "server/http/entity.h"

namespace spinaltap::http {

/// Files of one folder, kept in memory with their gzipped form; a file that changes on disk is read again.
/// Safe from several threads.
class StaticFiles {
 public:
  /// An empty folder name serves a page that says how to build the pages.
  explicit StaticFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// GET and HEAD; "/" is index.html. Symbolic links that lead out of the folder are not followed.
  [[nodiscard]] Response handle(const Request& request);

 private:
  struct Cached {
    std::filesystem::file_time_type written;
    std::uintmax_t size = 0;
    Entity entity;
  };
  std::filesystem::path folder_;
  std::mutex mutex_;
  std::map<std::string, Cached> cache_;
};

[[nodiscard]] const char* mimeTypeOf(const std::filesystem::path& file);

}  // namespace spinaltap::http
