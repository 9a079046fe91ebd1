// A replay that diverges says at which cycle and on which discs; held against stepping both runs side by side.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "tests/core/recording/drills.h"

namespace spinaltap::recording {
namespace {

/// What is to be seen of a point that goes: when, how dense, and which of the 64 around it that are of its disc stay.
struct Going {
  std::uint64_t cycle = 0, input = 0, density = 0;
  std::set<std::uint32_t> around;
  friend bool operator==(const Going&, const Going&) = default;
};

/// One run, cycle by cycle: what each input led to.
struct Trace {
  std::vector<std::uint64_t> hashes;  ///< after each input
  std::vector<std::uint64_t> cycles;  ///< after each input
  std::map<std::uint32_t, Going> gone;
};

std::set<std::uint32_t> around(const point_volume::PointVolume& volume, std::uint32_t point) {
  std::set<std::uint32_t> found;
  for (std::uint32_t i = point / 64 * 64; i < point / 64 * 64 + 64 && i < volume.lattice.points(); ++i) {
    const std::uint32_t points = volume.lattice.pointsPerDisc();
    if (i / points == point / points && volume.isAlive(i)) found.insert(i);
  }
  return found;
}

Trace trace(const Recording& recording) {
  Trace result;
  auto session = session::Session::create(recording.volume, recording.header.config).value();
  for (const session::Input& input : recording.inputs) {
    std::vector<std::uint32_t> removed;
    const session::Output output = session.step(
        input, [&](std::span<const std::uint32_t> some) { removed.insert(removed.end(), some.begin(), some.end()); });
    for (const std::uint32_t point : removed) {
      result.gone[point] = {output.cycle, result.hashes.size(), recording.volume.density_mg_cm3[point],
                            around(session.volume(), point)};
    }
    result.hashes.push_back(output.state_hash);
    result.cycles.push_back(output.cycle);
  }
  return result;
}

struct Expected {
  std::uint64_t cycle = 0;
  std::vector<std::uint32_t> discs;
};

/// By looking at every state and every point.
Expected differenceBetween(const Recording& recorded, const Trace& a, const Recording& tampered) {
  const Trace b = trace(tampered);
  std::size_t first = 0;
  while (first < a.hashes.size() && a.hashes[first] == b.hashes[first]) ++first;
  if (first == a.hashes.size()) return {};
  std::set<std::uint32_t> discs;
  std::size_t begin = 0;
  for (const Checkpoint& checkpoint : recorded.checkpoints) {
    const std::size_t end = checkpoint.inputs;
    const auto compare = [&](const Trace& one, const Trace& other) {
      for (const auto& [point, gone] : one.gone) {
        const auto found = other.gone.find(point);
        if (gone.input < begin || gone.input >= end || (found != other.gone.end() && found->second == gone)) continue;
        discs.insert(point / recorded.volume.lattice.pointsPerDisc());
      }
    };
    if (first < end && discs.empty()) compare(a, b), compare(b, a);
    begin = end;
  }
  return {std::max<std::uint64_t>(b.cycles[first], 1), {discs.begin(), discs.end()}};
}

void expectNamed(const Recording& recorded, const Trace& run, const Recording& tampered) {
  const Expected expected = differenceBetween(recorded, run, tampered);
  const ReplayReport report = *replay(tampered);
  EXPECT_EQ(report.verified, expected.cycle == 0);
  EXPECT_TRUE(report.comparable);
  EXPECT_EQ(report.first_difference, expected.cycle);
  EXPECT_EQ(report.discs, expected.discs);
}

Recording drilled() { return *read(record(mixedInputs(2500)).bytes); }

/// A point that goes in the middle of the drill, and how.
std::pair<std::uint32_t, Going> aPointThatGoes(const Trace& run, Random& random) {
  for (;;) {
    auto it = run.gone.begin();
    std::advance(it, static_cast<std::ptrdiff_t>(random.below(run.gone.size())));
    if (it->second.cycle > 20) return *it;
  }
}

/// Tampers with one point of the volume at a time, four from `seed`, and expects the difference named on its disc
/// alone; by which cycle is for `expect_cycle(report, cycle in which the point went)` to say.
void expectNamedOnThePointsDisc(std::uint64_t seed,
                                const std::function<void(point_volume::PointVolume&, std::uint32_t, Random&)>& tamper,
                                const std::function<void(const ReplayReport&, std::uint64_t)>& expect_cycle) {
  const Recording recorded = drilled();
  const Trace trace_of_it = trace(recorded);
  Random random(seed);
  for (int run = 0; run < 4; ++run) {
    const auto [point, going] = aPointThatGoes(trace_of_it, random);
    Recording tampered = recorded;
    tamper(tampered.volume, point, random);
    expectNamed(recorded, trace_of_it, tampered);
    const ReplayReport report = *replay(tampered);
    expect_cycle(report, going.cycle);
    EXPECT_EQ(report.discs, std::vector<std::uint32_t>{point / recorded.volume.lattice.pointsPerDisc()});
  }
}

TEST(Divergence, OfAFlippedAliveBitIsNamedByTheCycleThatFirstCutNearItAndByItsDisc) {
  const auto flip = [](point_volume::PointVolume& volume, std::uint32_t point, Random&) {
    volume.alive[point >> 6] ^= 1ull << (point & 63);
  };
  expectNamedOnThePointsDisc(
      20021110, flip, [](const ReplayReport& report, std::uint64_t went) { EXPECT_LE(report.first_difference, went); });
}

TEST(Divergence, OfAFlippedBitOfADensityIsNamedByTheCycleThatFeltOrCutThePointAndItsDisc) {
  const auto flip = [](point_volume::PointVolume& volume, std::uint32_t point, Random& random) {
    volume.density_mg_cm3[point] ^= static_cast<std::uint16_t>(1u << random.below(16));
  };
  expectNamedOnThePointsDisc(20021111, flip, [](const ReplayReport& report, std::uint64_t went) {
    EXPECT_LE(report.first_difference, went) << "the bit may feel a point before it cuts it";
    EXPECT_GT(report.first_difference, 0u);
  });
}

TEST(Divergence, OfFlippedBitsOfAnInputIsNamedAsSteppingBothSideBySideNamesIt) {
  const Recording recorded = drilled();
  const Trace trace_of_it = trace(recorded);
  Random random(20021112);
  int differed = 0;
  for (int run = 0; run < 12; ++run) {
    Recording tampered = recorded;
    session::Input& input = tampered.inputs[aPointThatGoes(trace_of_it, random).second.input];
    double* const fields[] = {&input.tip_mm.x, &input.tip_mm.y, &input.tip_mm.z, &input.axis.x, &input.axis.y};
    double& field = *fields[random.below(5)];
    std::uint64_t bits = 0;
    std::memcpy(&bits, &field, sizeof bits);
    bits ^= 1ull << (49 + random.below(15));
    std::memcpy(&field, &bits, sizeof bits);
    expectNamed(recorded, trace_of_it, tampered);
    differed += replay(tampered)->verified ? 0 : 1;
  }
  EXPECT_GT(differed, 3) << "else nothing was tested";
}

TEST(Divergence, OfTimeAloneIsOnNoDisc) {
  const Recording recorded = drilled();
  const Trace trace_of_it = trace(recorded);
  Recording tampered = recorded;
  std::size_t at = 1500;
  while (recorded.inputs[at].t_us == 0 || recorded.inputs[at + 1].t_us == 0) ++at;  // refused for its time
  tampered.inputs[at].t_us += 1;
  expectNamed(recorded, trace_of_it, tampered);
}

TEST(Divergence, OfDensitiesExchangedWithinACycleIsFoundByTheDiscsThoughTheirSumIsTheSame) {
  const Recording recorded = drilled();
  const Trace trace_of_it = trace(recorded);
  const std::uint32_t points = recorded.volume.lattice.pointsPerDisc();
  const auto& densities = recorded.volume.density_mg_cm3;
  for (const auto& [a, gone_a] : trace_of_it.gone) {
    for (const auto& [b, gone_b] : trace_of_it.gone) {
      if (gone_a.cycle != gone_b.cycle || a / points >= b / points || densities[a] == densities[b]) continue;
      Recording tampered = recorded;
      std::swap(tampered.volume.density_mg_cm3[a], tampered.volume.density_mg_cm3[b]);
      const ReplayReport report = *replay(tampered);
      EXPECT_FALSE(report.verified);
      EXPECT_GT(report.first_difference, 0u);
      EXPECT_EQ(report.discs, (std::vector<std::uint32_t>{a / points, b / points}));
      return;
    }
  }
  FAIL() << "no two points of different density and disc went in one cycle";
}

TEST(Divergence, IsNamedOnlyOnceHoweverLongItLasts) {
  const Recording recorded = drilled();
  const Trace trace_of_it = trace(recorded);
  Recording tampered = recorded;
  for (std::size_t i = 700; i < tampered.inputs.size(); ++i) tampered.inputs[i].tip_mm.x += 0.05;
  expectNamed(recorded, trace_of_it, tampered);
  EXPECT_LE(replay(tampered)->first_difference, 720u);
}

TEST(Divergence, IsToldInALine) {
  EXPECT_EQ(describe({true, true, 12, 5, 0, {}}), "verified: 12 cycles re-run, the same state");
  EXPECT_EQ(describe({false, true, 12, 5, 7, {4}}), "not verified: differs first at cycle 7, on disc 4");
  EXPECT_EQ(describe({false, true, 12, 5, 7, {0, 1, 2, 5, 8, 9}}),
            "not verified: differs first at cycle 7, on discs 0-2, 5, 8-9");
  EXPECT_EQ(describe({false, true, 12, 5, 7, {}}),
            "not verified: differs first at cycle 7, in force or time, on no disc");
  EXPECT_EQ(describe({false, true, 0, 5, 0, {}}), "not verified: the recording has no state to compare with");
  EXPECT_NE(describe({false, false, 12, 5, 0, {}}).find("before version 0.2"), std::string::npos);
}

}  // namespace
}  // namespace spinaltap::recording
