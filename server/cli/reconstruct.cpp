#include "server/cli/commands.h"
#include "server/jobs/reconstruct_job.h"

namespace spinaltap::cli {

Result<Outcome> runReconstruct(const ReconstructOptions& options, ProgressBar& bar) {
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  jobs::ReconstructJob job;
  job.case_id = options.case_id;
  job.method = surface::methodOf(options.method).value_or(job.method);
  job.sample_spacing_mm = options.sample_spacing_mm;
  job.tolerance_mm = options.tolerance_mm;
  job.smoothing_mm = options.smoothing_mm;
  job.cell_mm = options.cell_mm;
  auto figures = jobs::reconstructCase(*store, job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
