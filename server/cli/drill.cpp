
#include "server/cli/commands.h"
#include "server/haptic_client/remote_drill.h"
#include "server/jobs/drill_job.h"
#include "server/jobs/trace.h"

namespace spinaltap::cli {
namespace {

Result<jobs::DrillJob> jobOf(const DrillOptions& options) {
  jobs::DrillJob job;
  job.engine = options.engine;
  job.cycles = options.cycles;
  job.out = options.out;
  job.forces = options.forces;
  job.speed_rpm = options.speed_rpm;
  if (options.stiffness_N_mm) job.coupling = haptics::Coupling{*options.stiffness_N_mm, 0};
  if (!options.scene.empty()) {
    const auto scene = session::sceneNamed(options.scene);
    if (!scene) return tl::unexpected(scene.error());
    job.scene = *scene;
    return job;
  }
  const auto bytes = store::readFile(options.trace);
  if (!bytes) return tl::unexpected(bytes.error());
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  auto poses = jobs::parseTrace(text, std::filesystem::path(options.trace).filename().string());
  if (!poses) return tl::unexpected(poses.error());
  job.trace = std::move(*poses);
  return job;
}

Result<jobs::Figures> onScene(const jobs::DrillJob& job, ProgressBar& bar) {
  auto site = jobs::siteOfReport();
  if (!site) return tl::unexpected(site.error());
  return jobs::drill(nullptr, std::move(*site), job, bar.callback());
}

Result<jobs::Figures> onCase(const DrillOptions& options, jobs::DrillJob& job, ProgressBar& bar) {
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  auto site = jobs::siteOfPath(*store, options.case_id, options.path_id);
  if (!site) return tl::unexpected(site.error());
  job.keep = !options.no_store;
  return jobs::drill(&*store, std::move(*site), job, bar.callback());
}

Result<jobs::Figures> onServer(const DrillOptions& options, ProgressBar& bar) {
  haptic_client::RemoteDrill job;
  const auto server = haptic_client::parseAddress(options.server);
  if (!server) return fail(server.error().code, "--server: " + server.error().message);
  job.server = *server, job.case_id = options.case_id, job.path_id = options.path_id;
  for (const haptics::Holding holding : haptics::kHoldings) {
    if (haptics::nameOf(holding) == options.hand) job.hand.holding = holding;
  }
  job.hand.approach.feed_mm_s = options.feed_mm_s;
  job.device.rate_hz = options.rate_hz;
  job.device.max_force_N = options.max_force_N;
  job.device.damping_N_s_mm = options.damping_N_s_mm;
  job.device.max_stiffness_N_mm = options.stiffness_N_mm.value_or(0);
  job.start_mm = options.start_mm, job.depth_mm = options.depth_mm, job.seconds = options.seconds;
  job.pace = options.lockstep ? haptic_client::Pace::Lockstep : haptic_client::Pace::Real;
  job.realtime = options.realtime;
  job.forces = options.forces;
  return haptic_client::drillRemotely(job, bar.callback());
}

}  // namespace

Result<Outcome> runDrill(const DrillOptions& options, ProgressBar& bar) {
  if (!options.server.empty()) {
    auto figures = onServer(options, bar);
    if (!figures) return tl::unexpected(figures.error());
    return Outcome{std::move(*figures)};
  }
  auto job = jobOf(options);
  if (!job) return tl::unexpected(job.error());
  auto figures = options.volume.empty() ? onCase(options, *job, bar) : onScene(*job, bar);
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
