// server/jobs/tradeoff_job.h - what a surface costs and how true it is: table, charts and silhouettes.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/surface/methods.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

struct TradeoffJob {
  std::string case_id;                   ///< empty: the phantom, made in memory as the report's scanner sees it
  int reduce = 1;                        ///< the phantom's voxels this many times wider, for a quick look
  bool osteoporotic = false;             ///< the phantom
  std::vector<surface::Method> methods;  ///< empty: all
  std::vector<double> smoothings;        ///< each method with these alone; empty: the usual settings
  double sample_spacing_mm = 0;          ///< 0: as reconstruct chooses
  std::string out;                       ///< folder for the SVG files; empty: none are written
};

/// Figures: scene, spacing_mm, true_mm3, rows (one a setting; keys in server/cli/README.md), files, total_s.
/// @param store needed with a case_id alone; may be null otherwise.
/// @error NotFound (case, label), Io (the folder), and those of sampling.
/// @cost  minutes: some fifteen fits of up to 130,000 samples.
[[nodiscard]] Result<Figures> surfaceTradeoff(store::Store* store, const TradeoffJob& job, const Progress& progress);

/// The rows' chief columns, aligned, for people.
[[nodiscard]] std::string tradeoffTable(const Figures& figures);

}  // namespace spinaltap::jobs
