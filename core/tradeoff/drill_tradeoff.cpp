#include "core/tradeoff/drill_tradeoff.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/tradeoff/lattice_study.h"

namespace spinaltap::tradeoff {
namespace {

using drill::BitPose;
using point_volume::Lattice;
using point_volume::PointVolume;

constexpr double kWide_mm = 3.0;  // the report's volume

double quantile(std::vector<double>& values, double q) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The scene's cycles on a fresh volume.
struct Timed {
  PointVolume volume;
  std::size_t engine_bytes = 0;
  std::vector<double> each_s;
  std::vector<std::uint64_t> removed;
};

Result<Timed> runOnce(const DrillScene& scene, const Lattice& lattice, const DrillRunOptions& options,
                      const drill::EngineOptions& engine_options) {
  auto volume = point_volume::solidVolume(lattice, session::kSceneDensity_mg_cm3);
  if (!volume) return tl::unexpected(volume.error());
  Timed out{std::move(*volume), 0, {}, {}};
  const auto engine = drill::makeEngine(options.engine, out.volume, scene.bit, engine_options);
  if (!engine) return tl::unexpected(engine.error());
  out.each_s.reserve(scene.poses.size()), out.removed.reserve(scene.poses.size());
  const double up_mm = 0.5 * lattice.spacing_mm;  // z = 0 of the scene is the upper face of disc 0's cells
  for (BitPose pose : scene.poses) {
    pose.tip_mm.z -= up_mm;
    const double start = options.clock ? options.clock() : 0;
    const drill::Removal removal = (*engine)->step(out.volume, pose);
    out.each_s.push_back(options.clock ? options.clock() - start : 0);
    out.removed.push_back(removal.count);
  }
  out.engine_bytes = (*engine)->bytes();
  return out;
}

void measureRemoval(const DrillScene& scene, const Lattice& lattice, const std::vector<std::uint64_t>& removed,
                    DrillMeasured& row) {
  const double each_mm3 = point_volume::pointVolume_mm3(lattice);
  for (const std::uint64_t count : removed) row.removed += count;
  row.removed_mm3 = static_cast<double>(row.removed) * each_mm3;
  row.removed_error = row.removed_mm3 / scene.swept.total_mm3 - 1;

  const auto steady = static_cast<double>(removed.size() - scene.steady);
  double mean = 0;
  for (std::size_t n = scene.steady; n < removed.size(); ++n) mean += scene.swept.each_mm3[n] / steady;
  std::vector<double> shares;
  for (std::size_t n = scene.steady; n < removed.size(); ++n) {
    shares.push_back(1 + (static_cast<double>(removed[n]) * each_mm3 - scene.swept.each_mm3[n]) / mean);
  }
  const Share raw = rippleOf(shares);
  row.cycle_error = raw.mean - 1;
  // Over what is swept, not over what was removed.
  row.ripple = raw.deviation * raw.mean;
  const Share smooth = rippleOf(shares, kSmoothing_cycles);
  row.ripple_smoothed = smooth.deviation * smooth.mean;
}

std::uint64_t differing(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b) {
  std::uint64_t count = 0;
  for (std::size_t word = 0; word < a.size(); ++word) {
    count += static_cast<std::uint64_t>(std::popcount(a[word] ^ b[word]));
  }
  return count;
}

/// Runs a row's setting; `first` is the alive words that the spacing's first row leaves.
Result<void> measureRow(const DrillScene& scene, const Lattice& lattice, const DrillRunOptions& options,
                        std::vector<std::uint64_t>& first, DrillMeasured& row) {
  std::vector<double> fastest, met;
  for (int repeat = 0; repeat < std::max(1, options.repeats); ++repeat) {
    auto run = runOnce(scene, lattice, options, {row.precision, row.threads});
    if (!run) return tl::unexpected(run.error());
    met.insert(met.end(), run->each_s.begin(), run->each_s.end());
    if (repeat > 0) {
      for (std::size_t n = 0; n < fastest.size(); ++n) fastest[n] = std::min(fastest[n], run->each_s[n]);
      continue;
    }
    fastest = std::move(run->each_s);
    row.bytes = run->volume.bytes() + run->engine_bytes;
    measureRemoval(scene, lattice, run->removed, row);
    if (first.empty()) first = run->volume.alive;
    row.differing = differing(first, run->volume.alive);
  }
  row.median_s = quantile(fastest, 0.5);
  row.p999_s = quantile(fastest, 0.999);
  row.met_p999_s = quantile(met, 0.999);
  return {};
}

}  // namespace

Result<DrillScene> drillScene(session::Scene scene, double length_mm, const SweptOptions& options) {
  DrillScene out;
  out.bit = session::reportBit();
  if (!std::isfinite(length_mm) || length_mm < out.bit.cone_length_mm + 1) {
    return fail(ErrorCode::InvalidArgument, "drill trade-off: the path must be longer than the bit's cone by 1 mm");
  }
  const std::uint64_t cycles = session::sceneCycles(scene, length_mm);
  out.steady = static_cast<std::size_t>(cycles);
  for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
    const session::Input input = session::sceneInput(scene, cycle);
    out.poses.push_back({input.tip_mm, input.axis / norm(input.axis)});
    if (input.tip_mm.z >= out.bit.cone_length_mm) out.steady = std::min(out.steady, static_cast<std::size_t>(cycle));
  }
  out.reach = reachOf(out.bit, out.poses, 0);
  out.swept = sweptVolume(out.bit, out.poses, 0, options);
  return out;
}

Lattice drillLattice(const DrillScene& scene, double spacing_mm) {
  // Cells end half a spacing beyond the outermost ring and the last disc.
  const auto over = [&](double mm) { return static_cast<int>(std::ceil(mm / spacing_mm + 0.5)); };
  const int rings = std::max(static_cast<int>(std::floor(kWide_mm / spacing_mm + 0.5)), over(scene.reach.radius_mm));
  return {spacing_mm, std::max(2, rings), over(scene.reach.depth_mm), 0};
}

Result<std::vector<DrillMeasured>> measureDrill(const DrillScene& scene, double spacing_mm,
                                                const DrillRunOptions& options) {
  const Lattice lattice = drillLattice(scene, spacing_mm);
  if (const auto checked = point_volume::checkLattice(lattice); !checked) return tl::unexpected(checked.error());
  std::vector<double> build_s(options.threads.size(), 0.0);
  for (std::size_t n = 0; options.build && n < build_s.size(); ++n) {
    const auto seconds = options.build(lattice, options.threads[n]);
    if (!seconds) return tl::unexpected(seconds.error());
    build_s[n] = *seconds;
  }
  std::vector<DrillMeasured> rows;
  std::vector<std::uint64_t> first;
  for (const drill::Precision precision : options.precisions) {
    for (std::size_t n = 0; n < options.threads.size(); ++n) {
      DrillMeasured row;
      row.spacing_mm = spacing_mm, row.precision = precision, row.threads = options.threads[n];
      row.points = lattice.points(), row.build_s = build_s[n];
      if (const auto done = measureRow(scene, lattice, options, first, row); !done) return tl::unexpected(done.error());
      rows.push_back(row);
    }
  }
  return rows;
}

std::optional<std::size_t> recommended(std::span<const DrillMeasured> rows, const Wanted& wanted) {
  const auto order = [](const DrillMeasured& row) {
    return std::tuple(row.spacing_mm, row.precision == drill::Precision::Single, row.threads);
  };
  std::optional<std::size_t> best;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    if (!(rows[n].p999_s <= wanted.budget_s())) continue;
    if (!best || order(rows[n]) < order(rows[*best])) best = n;
  }
  return best;
}

std::string_view nameOf(drill::Precision precision) {
  return precision == drill::Precision::Single ? "single" : "double";
}

}  // namespace spinaltap::tradeoff
