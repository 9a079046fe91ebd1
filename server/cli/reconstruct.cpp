
#include "server/cli/commands.h"
#include "server/jobs/reconstruct_job.h"

namespace spinaltap::cli {

Result<Outcome> runReconstruct(const ReconstructOptions& options, ProgressBar& bar) {
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  const jobs::ReconstructJob job{options.case_id, options.sample_spacing_mm, options.tolerance_mm, options.smoothing_mm,
                                 options.cell_mm};
  auto figures = jobs::reconstructCase(*store, job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
