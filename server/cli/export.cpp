
#include "server/cli/commands.h"
#include "server/jobs/export_job.h"

namespace spinaltap::cli {

Result<Outcome> runExport(const ExportOptions& options, ProgressBar& bar) {
  const auto format = mesh_out::formatNamed(options.format);
  if (!format) return tl::unexpected(format.error());
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  const jobs::ExportJob job{options.case_id, *format, options.simplify_mm, options.out};
  auto figures = jobs::exportMesh(*store, job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
