// server/jobs/drill_tradeoff_page.h - the drill's trade-off as one HTML file.
#pragma once
#include <string>

#include "server/jobs/figures.h"

namespace spinaltap::jobs {

/// The recommendation, charts (inline SVG), every row as a table, and what it all means. Asks for nothing from
/// elsewhere and runs no script; well-formed XML too; light or dark as the reader's system is; every chart's figures
/// stand in the table, for whoever has it read out.
/// @param figures what drillTradeoff gives.
[[nodiscard]] std::string drillTradeoffPage(const Figures& figures);

}  // namespace spinaltap::jobs
