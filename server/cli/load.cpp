#include "server/load/load.h"

#include <cstdlib>

#include "server/cli/commands.h"

namespace spinaltap::cli {
namespace {

/// "http://127.0.0.1:8080" with or without a slash behind it.
Result<load::Target> parseTarget(const LoadOptions& options) {
  load::Target target;
  const std::string scheme = "http://";
  std::string place = options.server.rfind(scheme, 0) == 0 ? options.server.substr(scheme.size()) : options.server;
  if (!place.empty() && place.back() == '/') place.pop_back();
  const auto colon = place.rfind(':');
  const int port = colon == std::string::npos ? 0 : std::atoi(place.c_str() + colon + 1);
  if (port < 1 || port > 65535) return fail(ErrorCode::InvalidArgument, "--server: needs http://ADDRESS:PORT");
  target.host = place.substr(0, colon);
  target.port = static_cast<std::uint16_t>(port);
  target.case_id = options.case_id, target.path_id = options.path_id;
  return target;
}

}  // namespace

Result<Outcome> runLoad(const LoadOptions& options, ProgressBar& bar) {
  load::LoadJob job;
  job.sessions = options.sessions;
  job.rate_hz = options.rate_hz;
  job.seconds = options.seconds;
  job.rigid = options.rigid;
  job.realtime = options.realtime;
  if (!options.server.empty()) {
    auto target = parseTarget(options);
    if (!target) return tl::unexpected(target.error());
    job.target = *target;
  }
  auto figures = load::run(job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
