
#include "server/cli/commands.h"
#include "server/jobs/import_job.h"

namespace spinaltap::cli {

Result<Outcome> runImport(const ImportOptions& options, ProgressBar& bar) {
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  jobs::ImportJob job;
  job.request.from = options.from;
  job.request.series = options.series;
  if (!options.label_file.empty()) job.request.label = {options.label_file, options.label_value};
  job.label = options.name;
  auto figures = jobs::importCase(*store, job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  return Outcome{std::move(*figures)};
}

}  // namespace spinaltap::cli
