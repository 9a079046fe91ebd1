
#include "server/cli/commands.h"
#include "server/jobs/segment_job.h"

namespace spinaltap::cli {
namespace {

Result<jobs::SegmentJob> jobOf(const SegmentOptions& options) {
  jobs::SegmentJob job{options.case_id, {}, {}};
  if (options.seed.empty()) return job;
  const auto seed = parseVec3(options.seed, "--seed");
  if (!seed) return tl::unexpected(seed.error());
  if (options.grow) {
    job.grow.emplace();
    job.grow->seed_patient = *seed;
    if (options.threshold_HU) job.grow->threshold_hu = *options.threshold_HU;
  } else {
    job.isolate.emplace();
    job.isolate->seed_patient = *seed;
    if (options.threshold_HU) job.isolate->threshold_hu = *options.threshold_HU;
  }
  return job;
}

}  // namespace

Result<Outcome> runSegment(const SegmentOptions& options, ProgressBar& bar) {
  const auto job = jobOf(options);
  if (!job) return tl::unexpected(job.error());
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  auto figures = jobs::segmentCase(*store, *job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
