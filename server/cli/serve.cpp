#include <cstdio>

#include "server/cli/commands.h"
#include "server/http/server.h"
#include "server/jobs/recording_file.h"

namespace spinaltap::cli {
namespace fs = std::filesystem;
namespace {

/// Beside the program: build/release/bin/spinaltap -> build/web/dist, or /usr/bin -> /usr/share/spinaltap/web.
fs::path defaultWeb() {
  std::error_code error;
  const fs::path bin = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* there : {"../../web/dist", "../share/spinaltap/web", "../web/dist"}) {
    if (fs::is_regular_file(bin / there / "index.html", error)) return fs::canonical(bin / there, error);
  }
  return {};
}

}  // namespace

Result<Outcome> runServe(const ServeOptions& options, ProgressBar&) {
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  jobs::recoverRecordings(*store);
  http::Options http;
  http.address = options.address;
  http.port = options.port;
  http.hosts = options.hosts;
  http.drills.realtime = options.realtime;
  http.web = options.web.empty() ? defaultWeb() : fs::path(options.web);
  std::error_code ignored;
  if (!options.web.empty() && !fs::is_directory(http.web, ignored)) {
    return fail(ErrorCode::NotFound, "--web: there is no such folder");
  }
  if (http.web.empty()) printError("the web pages are not built: serving the interfaces only");
  const auto served = http::serve(*store, http, [&](const http::Listening& at) {
    std::printf("SpinalTap: %s\n", at.url.c_str());
    if (!at.realtime.empty()) std::printf("real time: %s\n", at.realtime.c_str());
    std::fflush(stdout);
  });
  if (!served) return tl::unexpected(served.error());
  return Outcome{jobs::Figures()};
}

}  // namespace spinaltap::cli
