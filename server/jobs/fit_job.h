// server/jobs/fit_job.h - the surface stage alone, on any point set: a fit, its residuals, and values at other points.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/rbf/rbf.h"
#include "server/jobs/figures.h"

namespace spinaltap::jobs {

struct FitJob {
  std::filesystem::path samples;  ///< rows x y z value, or x y z nx ny nz
  rbf::FitOptions options;
  std::optional<double> offset_mm;   ///< of off-surface samples along the normals; default: the points' usual spacing
  std::filesystem::path points;      ///< rows x y z to evaluate at; empty: none
  std::filesystem::path values;      ///< where the values go; empty: beside the points, with .values added
  bool gradients = false;            ///< rows value gx gy gz instead of value
  double evaluate_tolerance_mm = 0;  ///< 0: a hundredth of the fit's
};

/// Figures: samples, merged, centres, rounds, threads, tolerance_mm, smoothing_mm, residual_max_mm, residual_rms_mm,
/// residual_samples, reduction_max_mm, sum_abs_weights, read_s, fit_s (residuals included), peak_rss_mb, total_s; with
/// smoothing to be chosen noise_mm; with points: points, evaluate_s, points_per_s, evaluate_tolerance_mm, values_file.
/// @error Io, Corrupt (file, line and what was wrong), and those of rbf::fit.
[[nodiscard]] Result<Figures> fitPoints(const FitJob& job, const Progress& progress);

/// Samples from text: lines of four numbers, x y z and the signed distance there, or of six, a point and its normal.
/// @error Corrupt ("NAME line 12: ..."), NotFinite, Degenerate, Limit (over 20 million rows).
[[nodiscard]] Result<rbf::Samples> parseSamples(std::string_view text, std::string_view name,
                                                std::optional<double> offset_mm);

}  // namespace spinaltap::jobs
