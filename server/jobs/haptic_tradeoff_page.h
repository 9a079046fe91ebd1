// server/jobs/haptic_tradeoff_page.h - the trade-off of rate and delay as one HTML file (tradeoff_page.h).
#pragma once
#include <string>

#include "server/jobs/figures.h"

namespace spinaltap::jobs {

/// What follows, charts of force error, stiffest coupling and force over time, every row as a table, and what it all
/// means. @param figures what hapticTradeoff gives.
[[nodiscard]] std::string hapticTradeoffPage(const Figures& figures);

}  // namespace spinaltap::jobs
