#include "server/cli/commands.h"
#include "server/jobs/drill_tradeoff_job.h"
#include "server/jobs/haptic_tradeoff_job.h"
#include "server/jobs/tradeoff_job.h"

namespace spinaltap::cli {
namespace {

Result<Outcome> ofDrill(const TradeoffOptions& options, ProgressBar& bar) {
  jobs::DrillTradeoffJob job = options.drill;
  const auto scene = session::sceneNamed(options.scene);
  if (!scene) return tl::unexpected(scene.error());
  job.scene = *scene;
  job.html = options.html;
  if (options.full) job.length_mm = session::kReportLength_mm;
  auto figures = jobs::drillTradeoff(job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  std::string table = jobs::drillTradeoffTable(*figures);
  if (!job.html.empty()) table += job.html + "\n";
  return Outcome{std::move(*figures), true, std::move(table)};
}

Result<Outcome> ofHaptics(const TradeoffOptions& options, ProgressBar& bar) {
  jobs::HapticTradeoffJob job = options.hands;
  job.html = options.html;
  auto figures = jobs::hapticTradeoff(job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  std::string table = jobs::hapticTradeoffTable(*figures);
  if (!job.html.empty()) table += job.html + "\n";
  return Outcome{std::move(*figures), true, std::move(table)};
}

Result<Outcome> ofSurface(const TradeoffOptions& options, ProgressBar& bar) {
  jobs::TradeoffJob job;
  job.case_id = options.case_id;
  job.reduce = options.reduce;
  job.osteoporotic = options.osteoporotic;
  job.sample_spacing_mm = options.sample_spacing_mm;
  job.out = options.out;
  for (const std::string& name : options.methods) {
    if (const auto method = surface::methodOf(name)) job.methods.push_back(*method);
  }
  for (const std::string& text : options.smoothings) {
    const auto value = parseSmoothing(text);
    if (!value) return tl::unexpected(value.error());
    job.smoothings.push_back(*value);
  }
  std::optional<store::Store> store;
  if (!options.case_id.empty()) {
    auto opened = openStore(options.data);
    if (!opened) return tl::unexpected(opened.error());
    store.emplace(std::move(*opened));
  }
  auto figures = jobs::surfaceTradeoff(store ? &*store : nullptr, job, bar.callback());
  if (!figures) return tl::unexpected(figures.error());
  std::string table = jobs::tradeoffTable(*figures);
  if (figures->contains("files")) {
    for (const auto& file : (*figures)["files"]) table += options.out + "/" + file.get<std::string>() + "\n";
  }
  return Outcome{std::move(*figures), true, std::move(table)};
}

}  // namespace

Result<Outcome> runTradeoff(const TradeoffOptions& options, ProgressBar& bar) {
  if (options.haptics) return ofHaptics(options, bar);
  return options.surface ? ofSurface(options, bar) : ofDrill(options, bar);
}

}  // namespace spinaltap::cli
