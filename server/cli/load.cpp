#include "server/load/load.h"

#include "server/cli/commands.h"

namespace spinaltap::cli {

Result<Outcome> runLoad(const LoadOptions& options, ProgressBar& bar) {
  load::LoadJob job;
  job.sessions = options.sessions;
  job.rate_hz = options.rate_hz;
  job.seconds = options.seconds;
  job.rigid = options.rigid;
  job.realtime = options.realtime;
  if (!options.server.empty()) {
    const auto server = haptic_client::parseAddress(options.server);
    if (!server) return fail(server.error().code, "--server: " + server.error().message);
    job.target = load::Target{*server, options.case_id, options.path_id};
  }
  auto figures = load::run(job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
