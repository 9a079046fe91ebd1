// A cycle of a session, part by part, on the scene `hand`: what cutting takes, what feeling the bone adds, what a bit
// that a hand pulls adds, and what a client is told.
//
//   bench_session [--cycles N] [--repeats N]
//
// Ways take turns in one run; of each the median of the repeats' means, their spread, and the ratio to cutting alone.
// Then a look at every facet of the bit beside one that goes facet by facet, as plain code does.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "core/session/scenes.h"
#include "core/session/told_model.h"

namespace {

using namespace spinaltap;
using Clock = std::chrono::steady_clock;

double since_us(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

struct Options {
  std::uint64_t cycles = 12000;
  int repeats = 7;
};

double sum = 0;  // so that nothing is left out for not being used

double cutting_us(const Options& o) {
  point_volume::PointVolume volume = session::sceneVolume().value();
  const auto engine = drill::makeEngine("clearance", volume, session::reportBit()).value();
  const auto start = Clock::now();
  for (std::uint64_t i = 0; i < o.cycles; ++i) {
    const session::Input input = session::sceneInput(session::Scene::Hand, i);
    sum += static_cast<double>(engine->step(volume, {input.tip_mm, normalized(input.axis)}).count);
  }
  return since_us(start) / static_cast<double>(o.cycles);
}

enum class Told { Nothing, AsItChanges, EachCycle };

double session_us(const Options& o, bool coupled, Told told) {
  session::Config config{session::reportBit()};
  if (coupled) config.coupling = haptics::Coupling{};
  auto session = session::Session::create(session::sceneVolume().value(), config).value();
  session::ToldModel model;
  const auto start = Clock::now();
  for (std::uint64_t i = 0; i < o.cycles; ++i) {
    const session::Output output = session.step(session::sceneInput(session::Scene::Hand, i));
    if (told == Told::AsItChanges) sum += model.of(session, output.bit).rubbing_mm2;
    if (told == Told::EachCycle) sum += session.localModel().rubbing_mm2;
  }
  return since_us(start) / static_cast<double>(o.cycles);
}

/// Facet by facet: the disc, ring and slot of each, with libm's arctangent.
void lookOneByOne(const drill::Probe& probe, const point_volume::PointVolume& volume, const drill::BitPose& pose,
                  const Vec3& x, const Vec3& y, std::vector<std::uint16_t>& densities) {
  const point_volume::Lattice& lattice = volume.lattice;
  for (std::size_t i = 0; i < probe.count(); ++i) {
    const drill::Facet at = probe.facet(i);
    const Vec3 place = pose.tip_mm + (x * at.out_x + y * at.out_y) * at.across_mm + pose.axis * at.z_mm;
    densities[i] = 0;
    const int disc = static_cast<int>(std::lround(place.z / lattice.spacing_mm)) - lattice.first_disc;
    const int ring = static_cast<int>(std::lround(std::hypot(place.x, place.y) / lattice.spacing_mm));
    if (disc < 0 || disc >= lattice.discs || ring >= lattice.rings) continue;
    const int slots = point_volume::Lattice::slotsOf(ring);
    const double turn = std::atan2(place.y, place.x) / (2 * 3.14159265358979323846);
    const int slot = (static_cast<int>(std::lround(turn * slots)) + slots) % slots;
    const std::uint32_t point = lattice.index({disc, ring, slot});
    if (volume.isAlive(point)) densities[i] = volume.density_mg_cm3[point];
  }
}

double look_us(const Options& o, bool one_by_one) {
  const point_volume::PointVolume volume = session::sceneVolume().value();
  const drill::Probe probe(volume.lattice, session::reportBit());
  std::vector<std::uint16_t> densities(drill::Probe::kMostFacets);
  const auto start = Clock::now();
  for (std::uint64_t i = 0; i < o.cycles; ++i) {
    const session::Input input = session::sceneInput(session::Scene::Hand, i);
    const drill::BitPose pose{input.tip_mm, normalized(input.axis)};
    const Vec3 x = haptics::toolX(pose.axis), y = haptics::toolY(pose.axis);
    if (one_by_one) {
      lookOneByOne(probe, volume, pose, x, y, densities);
    } else {
      probe.look(volume, pose, x, y, densities);
    }
    sum += densities[i % probe.count()];
  }
  return since_us(start) / static_cast<double>(o.cycles);
}

struct Way {
  const char* name;
  std::function<double()> run;
  std::vector<double> us = {};
};

void compare(std::vector<Way> ways, int repeats) {
  for (int n = 0; n < repeats; ++n) {
    for (Way& way : ways) way.us.push_back(way.run());
  }
  double first = 0;
  for (Way& way : ways) {
    std::sort(way.us.begin(), way.us.end());
    const double median = way.us[way.us.size() / 2];
    if (first == 0) first = median;
    std::printf("%-44s %7.2f us  (%.2f .. %.2f)  x %5.2f\n", way.name, median, way.us.front(), way.us.back(),
                median / first);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options o;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--cycles") == 0) o.cycles = std::strtoull(argv[i + 1], nullptr, 10);
    if (std::strcmp(argv[i], "--repeats") == 0) o.repeats = std::atoi(argv[i + 1]);
  }
  o.cycles = std::max<std::uint64_t>(o.cycles, 1), o.repeats = std::max(o.repeats, 1);
  std::printf("a cycle of `hand`, %llu cycles, median of %d runs (least .. most)\n",
              static_cast<unsigned long long>(o.cycles), o.repeats);
  compare({{"cutting alone", [&] { return cutting_us(o); }},
           {"session, bit held rigidly", [&] { return session_us(o, false, Told::Nothing); }},
           {"session, bit coupled to a hand", [&] { return session_us(o, true, Told::Nothing); }},
           {"coupled, bone ahead told as it changes", [&] { return session_us(o, true, Told::AsItChanges); }},
           {"coupled, bone ahead told each cycle", [&] { return session_us(o, true, Told::EachCycle); }}},
          o.repeats);
  std::printf("a look at 128 facets\n");
  compare({{"together", [&] { return look_us(o, false); }}, {"one by one", [&] { return look_us(o, true); }}},
          o.repeats);
  return std::isfinite(sum) ? 0 : 1;
}
