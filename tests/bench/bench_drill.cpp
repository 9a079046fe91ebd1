// The drill engines and their rivals on the same scenes, in one process: what a cycle costs, what it tests, what it
// holds. Times differ between machines; ratios less so.
//
//   bench_drill [--discs N] [--repeats N] [--samples N] [--spacings 1]
//
// Each cycle counts with its fastest of `--repeats` runs: the rest is the machine's doing. `report` and `reference` run
// once, as they would take minutes: read their medians, which a few interrupted cycles do not move. Of `reference` and
// the grids `--samples` cycles are timed; up to each the reference's volume is carried on by `clearance`, which removes
// the same points, and the grids are brought by the cycle before it.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/session/scenes.h"
#include "tests/bench/grids.h"

namespace spinaltap {
namespace {

using Clock = std::chrono::steady_clock;
using drill::BitPose;
using point_volume::Lattice;
using point_volume::PointVolume;

struct Options {
  int discs = 378;
  int repeats = 3;
  std::size_t samples = 400;
  bool spacings = false;
};

/// A scene as poses: `on` and `off` at any step, `hand` as it is.
struct Script {
  std::string name;
  std::vector<BitPose> poses;
};

Script script(session::Scene scene, double step_mm, int discs) {
  const double length_mm = discs * session::reportLattice().spacing_mm;
  const auto cycles = static_cast<std::uint64_t>(length_mm / step_mm) + 1;
  Script result{std::string(nameOf(scene)) + (step_mm < 0.005 ? " 1 um" : " 10 um"), {}};
  for (std::uint64_t i = 0; i < cycles; ++i) {
    session::Input input = sceneInput(scene, scene == session::Scene::Hand ? i : 0);
    if (scene != session::Scene::Hand) input.tip_mm.z = step_mm * static_cast<double>(i);
    result.poses.push_back({input.tip_mm, input.axis / norm(input.axis)});
  }
  return result;
}

Lattice latticeAt(double spacing_mm, int discs) {
  const Lattice report = session::reportLattice();
  const double finer = report.spacing_mm / spacing_mm;
  return {spacing_mm, static_cast<int>(report.rings * finer), static_cast<int>(discs * finer), 0};
}

struct Run {
  std::vector<double> ns;  ///< of the timed cycles
  std::uint64_t tested = 0, removed = 0;
  double bytes_per_point = 0;

  [[nodiscard]] double quantile(double q) const {
    return ns[static_cast<std::size_t>(q * static_cast<double>(ns.size() - 1))];
  }
  [[nodiscard]] double mean() const {
    double sum = 0;
    for (const double x : ns) sum += x;
    return sum / static_cast<double>(ns.size());
  }
};

template <class Step>
double timed(const Step& step, Run& run) {
  const auto start = Clock::now();
  const drill::Removal removal = step();
  const auto stop = Clock::now();
  run.tested += removal.tested, run.removed += removal.count;
  return std::chrono::duration<double, std::nano>(stop - start).count();
}

/// The same cycles run once more: each counts with its fastest.
void keepFastest(Run& best, const Run& again) {
  if (best.ns.empty()) best = again;
  for (std::size_t i = 0; i < best.ns.size(); ++i) best.ns[i] = std::min(best.ns[i], again.ns[i]);
}

/// Every cycle of a script, and of each its fastest of `repeats` runs.
Run runAll(const std::string& engine_name, const Script& script, const Lattice& lattice, int repeats) {
  Run best;
  for (int r = 0; r < repeats; ++r) {
    PointVolume volume = *point_volume::solidVolume(lattice, session::kSceneDensity_mg_cm3);
    const auto engine = *drill::makeEngine(engine_name, volume, session::reportBit());
    Run run;
    for (const BitPose& pose : script.poses) run.ns.push_back(timed([&] { return engine->step(volume, pose); }, run));
    run.bytes_per_point = static_cast<double>(volume.bytes() + engine->bytes()) / static_cast<double>(lattice.points());
    keepFastest(best, run);
  }
  return best;
}

/// Some cycles of a script, evenly spread, once.
Run runSampled(const std::string& name, const Script& script, const Lattice& lattice, std::size_t samples) {
  Run run;
  const std::size_t stride = std::max<std::size_t>(2, script.poses.size() / samples);
  if (name == "reference") {
    PointVolume volume = *point_volume::solidVolume(lattice, session::kSceneDensity_mg_cm3);
    const auto reference = *drill::makeEngine(name, volume, session::reportBit());
    const auto carrier = *drill::makeEngine("clearance", volume, session::reportBit());
    for (std::size_t i = 0; i < script.poses.size(); ++i) {
      if (i % stride == 1) {
        run.ns.push_back(timed([&] { return reference->step(volume, script.poses[i]); }, run));
      } else {
        carrier->step(volume, script.poses[i]);
      }
    }
    run.bytes_per_point =
        static_cast<double>(volume.bytes() + reference->bytes()) / static_cast<double>(lattice.points());
    return run;
  }
  const auto grid = bench::makeGrid(name, lattice, session::reportBit(), session::kSceneDensity_mg_cm3);
  for (std::size_t i = 1; i < script.poses.size(); i += stride) {
    grid->step(script.poses[i - 1]);
    run.ns.push_back(timed([&] { return grid->step(script.poses[i]); }, run));
  }
  run.bytes_per_point = static_cast<double>(grid->bytes()) / static_cast<double>(grid->points());
  return run;
}

void print(const Script& script, const std::string& name, Run run, double ours_mean, double report_median) {
  std::sort(run.ns.begin(), run.ns.end());
  std::printf("%-11s %-10s %10.0f %10.0f %9.0f %9.0f %9.0f %9.2f %7.3f %9.1f %9.1f\n", script.name.c_str(),
              name.c_str(), run.mean(), run.quantile(0.5), run.quantile(0.99), run.quantile(0.999), run.ns.back(),
              static_cast<double>(run.tested) / static_cast<double>(std::max<std::uint64_t>(1, run.removed)),
              run.bytes_per_point, run.mean() / ours_mean, report_median / run.quantile(0.5));
  std::fflush(stdout);
}

void compare(const Script& script, const Options& options) {
  const Lattice lattice = latticeAt(session::reportLattice().spacing_mm, options.discs);
  const Run ours = runAll("clearance", script, lattice, options.repeats);
  Run report = runAll("report", script, lattice, 1);
  std::vector<double> sorted = report.ns;
  std::sort(sorted.begin(), sorted.end());
  const double report_median = sorted[sorted.size() / 2], ours_mean = ours.mean();
  print(script, "clearance", ours, ours_mean, report_median);
  print(script, "bounded", runAll("bounded", script, lattice, options.repeats), ours_mean, report_median);
  for (const char* grid : {"rows", "bytes"}) {
    Run best;
    for (int r = 0; r < options.repeats; ++r) {
      keepFastest(best, runSampled(grid, script, lattice, options.samples));
    }
    print(script, grid, std::move(best), ours_mean, report_median);
  }
  print(script, "report", std::move(report), ours_mean, report_median);
  print(script, "reference", runSampled("reference", script, lattice, options.samples / 4 + 1), ours_mean,
        report_median);
}

/// The first cycle of a fresh session deep in bone, and one that throws the bit to the other end.
void coldPoses(const Options& options, double spacing_mm) {
  const Lattice lattice = latticeAt(spacing_mm, options.discs);
  const double length_mm = lattice.discs * spacing_mm;
  const BitPose deep{{0.1, -0.05, 0.6 * length_mm}, normalized({0.02, 0.01, 1})};
  const BitPose thrown{{-1.0, 0.4, 0.9 * length_mm}, normalized({-0.03, 0.02, 1})};
  std::vector<double> first, second;
  Run run;
  for (int r = 0; r < std::max(5, options.repeats); ++r) {
    PointVolume volume = *point_volume::solidVolume(lattice, session::kSceneDensity_mg_cm3);
    const auto engine = *drill::makeEngine("clearance", volume, session::reportBit());
    run = {};
    first.push_back(timed([&] { return engine->step(volume, deep); }, run));
    second.push_back(timed([&] { return engine->step(volume, thrown); }, run));
  }
  std::sort(first.begin(), first.end()), std::sort(second.begin(), second.end());
  std::printf(
      "cold pose at %.3f mm: first cycle %.0f us, thrown across %.0f us (medians; fastest %.0f and %.0f); %llu "
      "points\n",
      spacing_mm, first[first.size() / 2] / 1e3, second[second.size() / 2] / 1e3, first[0] / 1e3, second[0] / 1e3,
      static_cast<unsigned long long>(run.removed));
}

/// How a cycle of `hand` grows with the number of points.
void finer(const Options& options) {
  std::printf("\n%-8s %12s %10s %10s %10s %10s %10s %8s\n", "spacing", "points", "removed", "mean ns", "median ns",
              "p99.9 ns", "max ns", "bytes/pt");
  for (const double spacing_mm : {0.1, 0.05, 0.025}) {
    const Lattice lattice = latticeAt(spacing_mm, options.discs);
    const Script hand = script(session::Scene::Hand, 0.001, options.discs);
    Run run = runAll("clearance", hand, lattice, spacing_mm < 0.04 ? 2 : options.repeats);
    std::sort(run.ns.begin(), run.ns.end());
    std::printf("%-8.3f %12llu %10.1f %10.0f %10.0f %10.0f %10.0f %8.3f\n", spacing_mm,
                static_cast<unsigned long long>(lattice.points()),
                static_cast<double>(run.removed) / static_cast<double>(run.ns.size()), run.mean(), run.quantile(0.5),
                run.quantile(0.999), run.ns.back(), run.bytes_per_point);
    std::fflush(stdout);
    coldPoses(options, spacing_mm);
  }
}

bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    const int value = std::atoi(argv[i + 1]);
    if (value < 1 || value > 10000) return false;
    if (key == "--discs") {
      options.discs = value;
    } else if (key == "--repeats") {
      options.repeats = value;
    } else if (key == "--samples") {
      options.samples = static_cast<std::size_t>(value);
    } else if (key == "--spacings") {
      options.spacings = true;
    } else {
      return false;
    }
  }
  return argc % 2 == 1;
}

}  // namespace
}  // namespace spinaltap

int main(int argc, char** argv) {
  using namespace spinaltap;
  Options options;
  if (!parse(argc, argv, options)) {
    std::fprintf(stderr, "usage: bench_drill [--discs N] [--repeats N] [--samples N] [--spacings 1]\n");
    return 2;
  }
  std::printf("%-11s %-10s %10s %10s %9s %9s %9s %9s %7s %9s %9s\n", "scene", "engine", "mean ns", "median", "p99",
              "p99.9", "max", "test/rem", "B/pt", "x ours", "x report");
  for (const session::Scene scene : {session::Scene::On, session::Scene::Off}) {
    for (const double step_mm : {0.001, 0.01}) compare(script(scene, step_mm, options.discs), options);
  }
  compare(script(session::Scene::Hand, 0.001, options.discs), options);
  coldPoses(options, 0.1);
  if (options.spacings) finer(options);
  return 0;
}
