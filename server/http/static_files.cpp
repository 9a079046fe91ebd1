#include "server/http/static_files.h"

#include <array>

#include "server/store/blob_store.h"

namespace spinaltap::http {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLargestFile = 64u << 20;
constexpr const char* kNotBuilt =
    "<!doctype html><html lang=\"en\"><title>SpinalTap</title><p>The pages are not built. <code>./run.sh</code> builds "
    "them; the interfaces under <code>/api/v1</code> work without.";

struct MimeType {
  const char *extension, *type;
  bool packs;
};
constexpr std::array<MimeType, 15> kTypes{{{".html", "text/html; charset=utf-8", true},
                                           {".js", "text/javascript; charset=utf-8", true},
                                           {".mjs", "text/javascript; charset=utf-8", true},
                                           {".css", "text/css; charset=utf-8", true},
                                           {".wasm", "application/wasm", true},
                                           {".json", "application/json", true},
                                           {".map", "application/json", true},
                                           {".svg", "image/svg+xml", true},
                                           {".txt", "text/plain; charset=utf-8", true},
                                           {".webmanifest", "application/manifest+json", true},
                                           {".png", "image/png", false},
                                           {".jpg", "image/jpeg", false},
                                           {".webp", "image/webp", false},
                                           {".ico", "image/x-icon", false},
                                           {".woff2", "font/woff2", false}}};

const MimeType* findType(const fs::path& file) {
  const std::string extension = file.extension().string();
  for (const MimeType& type : kTypes) {
    if (extension == type.extension) return &type;
  }
  return nullptr;
}

/// Vite names files in assets/ by their content.
bool neverChanges(const std::string& path) { return path.rfind("/assets/", 0) == 0; }

bool isInside(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  const fs::path real = fs::canonical(file, error), root = fs::canonical(folder, error);
  if (error) return false;
  const auto relative = real.lexically_relative(root);
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace

const char* mimeTypeOf(const fs::path& file) {
  const MimeType* type = findType(file);
  return type == nullptr ? "application/octet-stream" : type->type;
}

Response StaticFiles::handle(const Request& request) {
  const std::string path = request.path == "/" ? "/index.html" : request.path;
  const fs::path file = folder_ / path.substr(1);
  std::error_code error;
  if (folder_.empty() && request.path == "/") {
    Response page;
    page.text = kNotBuilt;
    page.headers = {{"Content-Type", "text/html; charset=utf-8"}, {"Cache-Control", "no-store"}};
    return page;
  }
  if (folder_.empty() || !fs::is_regular_file(file, error) || !isInside(file, folder_)) {
    return problem(404, "there is no such page");
  }
  const auto written = fs::last_write_time(file, error);
  const auto size = fs::file_size(file, error);
  const std::scoped_lock lock(mutex_);
  Cached& cached = cache_[path];
  if (!cached.entity.plain || cached.written != written || cached.size != size) {
    auto bytes = store::readFile(file, kLargestFile);
    if (!bytes) return problem(500, bytes.error().message);
    const MimeType* type = findType(file);
    Entity entity;
    entity.tag = store::blobIdOf(*bytes).substr(0, 32);
    entity.type = mimeTypeOf(file);
    entity.cache_control = neverChanges(path) ? "public, max-age=31536000, immutable" : "no-cache";
    if (type != nullptr && type->packs) {
      entity.packed = std::make_shared<const std::vector<std::byte>>(store::gzip(*bytes));
    }
    entity.plain = std::make_shared<const std::vector<std::byte>>(std::move(*bytes));
    cached = {written, size, std::move(entity)};
  }
  return answer(request, cached.entity);
}

}  // namespace spinaltap::http
