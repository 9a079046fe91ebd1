// The engines on the three scenes, in one process: median and spread per cycle, points tested per point removed, and
// the ratio to the 2002 algorithm. Times differ between machines; ratios less so.
//
//   bench_drill [--discs N] [--samples N]
//
// Every engine is timed on the same cycles, spread evenly over the scene. Between them the reference's volume is
// carried on by `bounded`, which removes the same points, since testing every point of every cycle of `hand` takes
// minutes.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "core/session/scenes.h"

namespace spinaltap {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  int discs = 378;
  std::uint64_t samples = 400;
};

struct Run {
  std::vector<double> ns;  // of the sampled cycles
  std::uint64_t tested = 0, removed = 0, removed_in_all = 0;

  [[nodiscard]] double quantile(double q) const { return ns[static_cast<std::size_t>(q * double(ns.size() - 1))]; }
};

Run run(session::Scene scene, const std::string& name, const Options& options) {
  auto volume = *session::sceneVolume(options.discs);
  const auto timed = *drill::makeEngine(name, volume, session::reportBit());
  const auto bounded = *drill::makeEngine("bounded", volume, session::reportBit());
  const std::uint64_t cycles = session::sceneCycles(scene, options.discs * volume.lattice.spacing_mm);
  const std::uint64_t stride = std::max<std::uint64_t>(1, cycles / options.samples);
  Run result;
  for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
    const session::Input input = session::sceneInput(scene, cycle);
    const drill::BitPose pose{input.tip_mm, input.axis / norm(input.axis)};
    const bool sampled = cycle % stride == 0;
    drill::Engine& engine = name == "reference" && !sampled ? *bounded : *timed;
    const auto start = Clock::now();
    const drill::Removal removal = engine.step(volume, pose);
    const auto stop = Clock::now();
    result.removed_in_all += removal.count;
    if (!sampled) continue;
    result.ns.push_back(std::chrono::duration<double, std::nano>(stop - start).count());
    result.tested += removal.tested, result.removed += removal.count;
  }
  std::sort(result.ns.begin(), result.ns.end());
  return result;
}

void compare(session::Scene scene, const Options& options) {
  std::map<std::string, Run> runs;
  for (const std::string_view name : drill::engineNames()) {
    runs.emplace(std::string(name), run(scene, std::string(name), options));
  }
  const double rival = runs.at("report").quantile(0.5);
  for (const auto& [name, r] : runs) {
    std::printf("%-5s %-10s %12.0f %12.0f %12.0f %14.1f %10.3f %10llu\n", std::string(nameOf(scene)).c_str(),
                name.c_str(), r.quantile(0.5), r.quantile(0.1), r.quantile(0.9),
                double(r.tested) / double(std::max<std::uint64_t>(1, r.removed)), rival / r.quantile(0.5),
                static_cast<unsigned long long>(r.removed_in_all));
  }
}

bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string key = argv[i];
    const int value = std::atoi(argv[i + 1]);
    if (value < 1 || value > 10000) return false;
    if (key == "--discs") {
      options.discs = value;
    } else if (key == "--samples") {
      options.samples = static_cast<std::uint64_t>(value);
    } else {
      return false;
    }
  }
  return argc % 2 == 1;
}

}  // namespace
}  // namespace spinaltap

int main(int argc, char** argv) {
  spinaltap::Options options;
  if (!spinaltap::parse(argc, argv, options)) {
    std::fprintf(stderr, "usage: bench_drill [--discs N] [--samples N]\n");
    return 2;
  }
  std::printf("%-5s %-10s %12s %12s %12s %14s %10s %10s\n", "scene", "engine", "median ns", "10 % ns", "90 % ns",
              "tested/removed", "x report", "removed");
  for (const std::string_view name : spinaltap::session::sceneNames()) {
    spinaltap::compare(*spinaltap::session::sceneNamed(name), options);
  }
  return 0;
}
