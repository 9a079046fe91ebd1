// server/jobs/haptic_tradeoff_job.h - what rate, delay and extrapolation do to the force that a hand feels, and to how
// stiff a wall it can hold: figures, table, page.
#pragma once
#include <span>
#include <string>

#include "core/base/result.h"
#include "core/tradeoff/haptic_tradeoff.h"
#include "server/jobs/figures.h"
#include "server/jobs/tradeoff_page.h"

namespace spinaltap::jobs {

struct HapticTradeoffJob {
  tradeoff::HapticGrid grid;
  std::string html;  ///< the page's file; empty: none is written
};

/// A force that is wrong by less than this share of itself feels right: hands tell forces apart by 5 to 10 % (X.-D.
/// Pang, H. Z. Tan and N. I. Durlach, Perception & Psychophysics 49, 1991, 531-540).
inline constexpr double kFelt_percent = 10;
/// Net energy that counts as given by the port, mJ: sums of 60,000 products of some 10 N and 0.01 mm are rounded by
/// less than 1e-10 mJ.
inline constexpr double kGiven_mJ = 1e-9;

/// Figures: keys in server/cli/README.md. All is simulated: the same grid gives the same figures everywhere.
/// @error as tradeoff::checkGrid; Io (the page's place; before anything runs).
/// @cost  about a minute of two cores as it stands.
[[nodiscard]] Result<Figures> hapticTradeoff(const HapticTradeoffJob& job, const Progress& progress);

/// For people: the summary's rows, aligned, what they mean, and what follows.
[[nodiscard]] std::string hapticTradeoffTable(const Figures& figures);

/// Of a row a rate and network, and of a row a case.
[[nodiscard]] std::span<const TableColumn> hapticSummaryColumns();
[[nodiscard]] std::span<const TableColumn> hapticColumns();

}  // namespace spinaltap::jobs
