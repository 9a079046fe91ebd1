
#include "server/cli/commands.h"

namespace spinaltap::cli {

Result<Outcome> runPlan(const PlanOptions& options, ProgressBar& bar) {
  const auto entry = parseVec3(options.entry, "--entry");
  if (!entry) return tl::unexpected(entry.error());
  const auto target = parseVec3(options.target, "--target");
  if (!target) return tl::unexpected(target.error());
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  jobs::Stopwatch watch;
  const plan::Path path{*entry, *target, options.bit, options.radius_mm, options.lead_mm, options.spacing_mm};
  const auto made = jobs::planPath(*store, {options.case_id, options.label, path}, bar.callback());
  if (!made) return tl::unexpected(made.error());
  jobs::Figures figures{{"path_id", made->id}};
  figures.update(jobs::describe(*made));
  figures.erase("id");
  figures["total_s"] = watch.lap_s();
  return Outcome{std::move(figures)};
}

}  // namespace spinaltap::cli
