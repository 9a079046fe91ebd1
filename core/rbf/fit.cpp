#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "core/rbf/direct_sum.h"
#include "core/rbf/prepare.h"
#include "core/rbf/rbf.h"
#include "core/rbf/reduce.h"
#include "core/rbf/smoothing.h"
#include "core/rbf/system.h"

namespace spinaltap::rbf {
namespace {

// With reduction, the full fit is only a step on the way and need not be closer than this share of what it allows.
constexpr double kFullFitShare = 0.2;

Result<void> checkOptions(const FitOptions& o) {
  if (!(o.tolerance_mm > 0) || !std::isfinite(o.tolerance_mm)) {
    return fail(ErrorCode::InvalidArgument, "fit tolerance is not positive and finite");
  }
  if (!(o.smoothing >= 0 || o.smoothing == kAutoSmoothing) || !std::isfinite(o.smoothing)) {
    return fail(ErrorCode::InvalidArgument, "fit smoothing is negative or not finite");
  }
  if (!(o.reduce_mm >= 0) || !std::isfinite(o.reduce_mm)) {
    return fail(ErrorCode::InvalidArgument, "the reduction's tolerance is negative or not finite");
  }
  return {};
}

std::string shortNumber(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

/// A part of a whole job's progress.
Progress part(const Progress& progress, double from, double to) {
  if (!progress) return {};
  return [&progress, from, to](double fraction) { progress(from + (to - from) * fraction); };
}

/// Positions in units of the set, back to the user's.
Model modelOf(const PreparedSamples& s, const std::vector<Vec3>& centres, const SystemSolution& solution) {
  Model m;
  m.centroid_patient = s.centroid_patient;
  m.radius_mm = s.radius_mm;
  for (const Vec3& c : centres) m.centres.push_back(c * s.scale_mm);
  for (const double u : solution.weights) m.weights.push_back(-u / s.scale_mm);
  m.constant = solution.polynomial[0];
  m.linear = Vec3{solution.polynomial[1], solution.polynomial[2], solution.polynomial[3]} / s.scale_mm;
  return m;
}

/// Of the samples as they were given, by direct summation. Where no sample was merged or left out as a centre, they are
/// the centres, and every distance serves twice.
void measureResiduals(const Samples& samples, const Model& model, unsigned threads, FitReport& report) {
  const std::size_t all = samples.positions.size();
  const bool own_centres = model.centres.size() == all && std::uint64_t{all} * all <= kDirectPairs;
  const std::uint64_t affordable = std::max<std::uint64_t>(1000, kDirectPairs / model.centres.size());
  report.residual_samples = static_cast<std::size_t>(std::min<std::uint64_t>(all, affordable));
  const auto chosen = [&](std::size_t n) {
    return static_cast<std::size_t>(std::uint64_t{n} * all / report.residual_samples);
  };
  std::vector<double> values(report.residual_samples);
  if (own_centres) {
    values = distancesAmong(Coordinates(model.centres), model.weights, threads);
    for (std::size_t i = 0; i < all; ++i) values[i] += model.constant + dot(model.linear, model.centres[i]);
  } else {
    std::vector<Vec3> points(report.residual_samples);
    for (std::size_t n = 0; n < points.size(); ++n) points[n] = samples.positions[chosen(n)];
    values =
        distancesFrom(Coordinates(points, model.centroid_patient), Coordinates(model.centres), model.weights, threads);
    for (std::size_t n = 0; n < values.size(); ++n)
      values[n] += model.constant + dot(model.linear, points[n] - model.centroid_patient);
  }
  double squares = 0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    const double e = values[n] - samples.distances_mm[chosen(n)];
    report.residual_max_mm = std::max(report.residual_max_mm, std::abs(e));
    squares += e * e;
  }
  report.residual_rms_mm = std::sqrt(squares / static_cast<double>(values.size()));
}

class Fitting {
 public:
  Fitting(const Samples& samples, const FitOptions& options, const Progress& progress)
      : samples_(samples), options_(options), progress_(progress) {}

  Result<Fit> run() {
    auto prepared = prepare(samples_);
    if (!prepared) return tl::unexpected(prepared.error());
    prepared_ = std::move(*prepared);
    chooseRidge();
    if (auto ok = solveFull(); !ok) return tl::unexpected(ok.error());
    std::vector<Vec3> centres = prepared_.positions;
    if (options_.reduce_mm > 0) {
      if (auto ok = reduceTo(centres); !ok) return tl::unexpected(ok.error());
    }
    Fit fit{modelOf(prepared_, centres, solution_), report_};
    FitReport& r = fit.report;
    r.samples = samples_.positions.size(), r.merged = prepared_.merged, r.centres = centres.size();
    for (const double w : fit.model.weights) r.sum_abs_weights += std::abs(w);
    measureResiduals(samples_, fit.model, options_.threads, r);
    if (progress_) progress_(1.0);
    return fit;
  }

 private:
  void chooseRidge() {
    ridge_ = options_.smoothing / prepared_.scale_mm;
    if (options_.smoothing == kAutoSmoothing) {
      report_.noise_mm = estimateNoise(prepared_.positions, prepared_.distances, options_.threads);
      ridge_ = ridgeFor(report_.noise_mm, prepared_.positions, prepared_.distances, options_.threads);
    }
    report_.smoothing = ridge_ * prepared_.scale_mm;
  }

  Result<void> solveFull() {
    const auto system = System::make(prepared_.positions, ridge_, options_.threads);
    if (!system) return tl::unexpected(system.error());
    const bool reducing = options_.reduce_mm > 0;
    const double tolerance =
        reducing ? std::max(options_.tolerance_mm, kFullFitShare * options_.reduce_mm) : options_.tolerance_mm;
    solution_ = system->solve(prepared_.distances, tolerance, part(progress_, 0.1, reducing ? 0.4 : 0.9));
    report_.rounds = solution_.rounds;
    if (solution_.residual_max <= tolerance) return {};
    return fail(ErrorCode::NotConverged, "the fit came within " + shortNumber(solution_.residual_max) +
                                             " of its samples, not within " + shortNumber(tolerance));
  }

  /// The smooth values at the samples are the given ones less ridge times weight.
  Result<void> reduceTo(std::vector<Vec3>& centres) {
    std::vector<double> smooth = prepared_.distances;
    for (std::size_t i = 0; i < smooth.size(); ++i) smooth[i] -= ridge_ * solution_.weights[i];
    auto reduced = reduce(prepared_.positions, smooth, options_.reduce_mm, options_.threads, part(progress_, 0.4, 0.9));
    if (!reduced) return tl::unexpected(reduced.error());
    centres.clear();
    for (const std::uint32_t i : reduced->centres) centres.push_back(prepared_.positions[i]);
    solution_ = std::move(reduced->solution);
    report_.reduction_max_mm = reduced->largest;
    return {};
  }

  const Samples& samples_;
  const FitOptions& options_;
  const Progress& progress_;
  PreparedSamples prepared_;
  double ridge_ = 0;  ///< in units of the set
  SystemSolution solution_;
  FitReport report_;
};

}  // namespace

Result<Fit> fit(const Samples& samples, const FitOptions& options, const Progress& progress) {
  if (auto ok = checkOptions(options); !ok) return tl::unexpected(ok.error());
  return Fitting(samples, options, progress).run();
}

}  // namespace spinaltap::rbf
