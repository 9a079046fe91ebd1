#include "server/cli/commands.h"
#include "server/jobs/fit_job.h"

namespace spinaltap::cli {
Result<Outcome> runFit(const FitOptions& options, ProgressBar& bar) {
  const auto smoothing = parseSmoothing(options.smoothing);
  if (!smoothing) return tl::unexpected(smoothing.error());
  jobs::FitJob job;
  job.samples = options.file;
  job.options = {options.tolerance_mm, *smoothing, options.reduce_mm, options.threads};
  job.offset_mm = options.offset_mm;
  job.points = options.points, job.values = options.values;
  job.gradients = options.gradients;
  job.evaluate_tolerance_mm = options.evaluate_tolerance_mm;
  auto figures = jobs::fitPoints(job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
