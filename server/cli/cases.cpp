
#include "core/drill/engine.h"
#include "server/cli/commands.h"

namespace spinaltap::cli {

Result<Outcome> runCases(const CasesOptions& options, ProgressBar&) {
  auto store = openStore(options.data);
  if (!store) return tl::unexpected(store.error());
  const auto cases = store->cases();
  if (!cases) return tl::unexpected(cases.error());
  auto rows = jobs::Figures::array();
  for (const store::Case& row : *cases) {
    rows.push_back({{"id", row.id},
                    {"label", row.label},
                    {"created", row.created},
                    {"stage", store::nameOf(row.stage)},
                    {"paths", row.paths},
                    {"recordings", row.recordings}});
  }
  return Outcome{{{"cases", std::move(rows)}}};
}

Result<Outcome> runVersion() { return Outcome{{{"version", SPINALTAP_VERSION}, {"engines", drill::engineNames()}}}; }

}  // namespace spinaltap::cli
