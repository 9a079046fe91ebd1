// A recorded drill: bytes a sample, seconds to open, and milliseconds to jump to any moment of it.
//
//   bench_recording [--cycles N] [--jumps N]
//
// Drills `on`, `off` and `hand` as far as they go, or N cycles; then `hand` with what a device adds (noise of 1 um and
// 1e-5 in the axis, as doubles and as floats). Then a drill of N cycles (600,000: ten minutes at 1 kHz) by `hand`,
// slowed down so that it lasts, is opened and jumped about in.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/recording/player.h"
#include "core/session/scenes.h"

namespace {

using namespace spinaltap;
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Drilled {
  std::vector<std::byte> bytes;
  std::size_t before = 0;  ///< bytes of header and volume
  double append_s = 0, longest_append_s = 0;
};

template <class InputAt>
Drilled drill(std::uint64_t cycles, const InputAt& inputAt) {
  Drilled result;
  point_volume::PointVolume volume = session::sceneVolume().value();
  const session::Config config{session::reportBit(), "clearance"};
  auto writer = recording::Writer::begin({"bench", "", "", "", config}, volume, [&](std::span<const std::byte> more) {
                  result.bytes.insert(result.bytes.end(), more.begin(), more.end());
                  return true;
                }).value();
  result.before = result.bytes.size();
  auto session = session::Session::create(std::move(volume), config).value();
  std::vector<std::uint32_t> removed;
  for (std::uint64_t i = 0; i < cycles; ++i) {
    const session::Input input = inputAt(i);
    removed.clear();
    const session::Output output = session.step(
        input, [&](std::span<const std::uint32_t> some) { removed.insert(removed.end(), some.begin(), some.end()); });
    const auto start = Clock::now();
    (void)writer.append(input, output, removed, session.volume());  // the sink cannot fail
    const double took_s = secondsSince(start);
    result.append_s += took_s, result.longest_append_s = std::max(result.longest_append_s, took_s);
  }
  (void)writer.finish();
  return result;
}

template <class InputAt>
void reportSize(const char* name, std::uint64_t cycles, const InputAt& inputAt) {
  const Drilled drilled = drill(cycles, inputAt);
  std::printf("%-22s %8llu samples  %6.2f bytes a sample  append: mean %5.2f us, longest %6.0f us\n", name,
              static_cast<unsigned long long>(cycles),
              static_cast<double>(drilled.bytes.size() - drilled.before) / static_cast<double>(cycles),
              1e6 * drilled.append_s / static_cast<double>(cycles), 1e6 * drilled.longest_append_s);
}

session::Input noisyHand(std::uint64_t cycle, bool floats) {
  Random random(cycle);
  session::Input input = session::sceneInput(session::Scene::Hand, cycle);
  for (double* v : {&input.tip_mm.x, &input.tip_mm.y, &input.tip_mm.z}) *v += 1e-3 * random.gaussian();
  input.axis = normalized(input.axis + Vec3{1e-5 * random.gaussian(), 1e-5 * random.gaussian(), 0});
  if (!floats) return input;
  for (double* v : {&input.tip_mm.x, &input.tip_mm.y, &input.tip_mm.z, &input.axis.x, &input.axis.y, &input.axis.z}) {
    *v = static_cast<float>(*v);
  }
  return input;
}

/// The whole path, slowed down so that it takes `cycles`.
session::Input longHand(std::uint64_t cycle, std::uint64_t cycles) {
  session::Input input = session::sceneInput(session::Scene::Hand, cycle);
  input.tip_mm.z = session::kReportLength_mm * static_cast<double>(cycle) / static_cast<double>(cycles);
  return input;
}

void reportJumps(std::uint64_t cycles, int jumps) {
  const Drilled drilled = drill(cycles, [&](std::uint64_t i) { return longHand(i, cycles); });
  const auto start = Clock::now();
  auto recording = recording::read(drilled.bytes).value();
  const double read_s = secondsSince(start);
  auto player = recording::Player::create(std::move(recording)).value();
  const double open_s = secondsSince(start);
  std::printf(
      "\n%llu cycles, %llu points removed, %.1f MB: read %.2f s, opened (verified: %s) %.2f s, player %.1f MB\n",
      static_cast<unsigned long long>(player.cycles()),
      static_cast<unsigned long long>(player.cycles() == 0 ? 0 : player.moment(player.cycles()).removed_total),
      1e-6 * static_cast<double>(drilled.bytes.size()), read_s, player.report().verified ? "yes" : "NO", open_s,
      1e-6 * static_cast<double>(player.bytes()));
  Random random(20021120);
  std::vector<double> took_ms;
  for (int i = 0; i < jumps; ++i) {
    const std::uint64_t to = i < 2 ? (i == 0 ? player.cycles() : 0) : random.below(player.cycles() + 1);
    const auto before = Clock::now();
    player.seek(to);
    took_ms.push_back(1e3 * secondsSince(before));
  }
  std::sort(took_ms.begin(), took_ms.end());
  const auto part = [&](double p) {
    return took_ms[static_cast<std::size_t>(p * static_cast<double>(took_ms.size() - 1))];
  };
  std::printf("%d jumps: median %.4f ms, p99 %.4f ms, longest %.4f ms\n", jumps, part(0.5), part(0.99), part(1.0));
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t cycles = 600'000;
  int jumps = 2000;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--cycles") == 0) cycles = std::strtoull(argv[i + 1], nullptr, 10);
    if (std::strcmp(argv[i], "--jumps") == 0) jumps = std::atoi(argv[i + 1]);
  }
  cycles = std::clamp<std::uint64_t>(cycles, 1, session::kMostSceneCycles);
  jumps = std::max(jumps, 1);
  for (const session::Scene scene : {session::Scene::On, session::Scene::Off, session::Scene::Hand}) {
    reportSize(std::string(session::nameOf(scene)).c_str(),
               std::min(cycles, session::sceneCycles(scene, session::kReportLength_mm)),
               [&](std::uint64_t i) { return session::sceneInput(scene, i); });
  }
  const std::uint64_t some = std::min<std::uint64_t>(cycles, 20'000);
  reportSize("hand, noisy doubles", some, [](std::uint64_t i) { return noisyHand(i, false); });
  reportSize("hand, noisy floats", some, [](std::uint64_t i) { return noisyHand(i, true); });
  reportJumps(cycles, jumps);
  return 0;
}
