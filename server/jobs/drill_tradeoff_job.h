// server/jobs/drill_tradeoff_job.h - what drilling costs on this machine and how true it is: figures, table, page.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/session/scenes.h"
#include "server/jobs/figures.h"
#include "server/jobs/tradeoff_page.h"

namespace spinaltap::jobs {

struct DrillTradeoffJob {
  session::Scene scene = session::Scene::Hand;
  double length_mm = 12;  ///< of the path that is drilled
  std::vector<double> spacings_mm{0.4, 0.2, 0.1, 0.05, 0.025};
  std::vector<int> threads{1, 2};
  double rate_hz = 1000, headroom = 4;
  int repeats = 3;   ///< of a row: each cycle counts with its fastest
  std::string html;  ///< the page's file; empty: none is written
};

/// A row's volume and engine may take so much: 2.2 bytes a point.
inline constexpr double kMostMemory_mb = 1000;

/// Figures: keys in server/cli/README.md. What is drilled is solid, so that what is swept is known; the point volume
/// whose building is timed lies in the phantom (build_site.h).
/// @error InvalidArgument (length, no spacing), Limit (kMostMemory_mb; before anything runs), Io (the page).
/// @cost  about a minute as it stands, on a machine of two cores.
[[nodiscard]] Result<Figures> drillTradeoff(const DrillTradeoffJob& job, const Progress& progress);

/// For people: the rows, aligned, what they mean, and the recommendation.
[[nodiscard]] std::string drillTradeoffTable(const Figures& figures);

[[nodiscard]] std::span<const TableColumn> drillColumns();

}  // namespace spinaltap::jobs
