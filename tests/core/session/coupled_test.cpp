// A bit that a hand pulls at: what it cuts, what it feels, and where it is stopped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/drill/predicate.h"
#include "core/haptics/hand.h"
#include "core/session/session.h"

namespace spinaltap::session {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

constexpr plan::Bit kBit{3, 5, 50};

/// Bone from z = 0 on, in layers: thickness in mm, density in mg/cm3 (0: none).
struct Layer {
  double thick_mm;
  std::uint16_t density_mg_cm3;
};
PointVolume layered(double spacing_mm, const std::vector<Layer>& layers, double radius_mm = 2.5) {
  double length = 0;
  for (const Layer& layer : layers) length += layer.thick_mm;
  const Lattice lattice{spacing_mm, static_cast<int>(radius_mm / spacing_mm) + 1, static_cast<int>(length / spacing_mm),
                        0};
  PointVolume volume = *point_volume::solidVolume(lattice, 1);
  for (std::uint32_t i = 0; i < lattice.points(); ++i) {
    double z = lattice.discZ_mm(static_cast<int>(i / lattice.pointsPerDisc())) + 0.5 * spacing_mm;
    std::size_t n = 0;
    while (n + 1 < layers.size() && z > layers[n].thick_mm) z -= layers[n++].thick_mm;
    volume.density_mg_cm3[i] = layers[n].density_mg_cm3;
    if (layers[n].density_mg_cm3 == 0) volume.alive[i >> 6] &= ~(std::uint64_t{1} << (i & 63));
  }
  return volume;
}

Session coupled(PointVolume volume, const haptics::Coupling& coupling = {}) {
  Config config{kBit};
  config.coupling = coupling;
  auto session = Session::create(std::move(volume), config);
  EXPECT_TRUE(session.has_value());
  return std::move(*session);
}

Input inputAt(std::uint64_t t_us, const Vec3& tip_mm, bool spinning = true) {
  Input input;
  input.t_us = t_us, input.tip_mm = tip_mm, input.spinning = spinning;
  return input;
}

/// What a steady feed asks for, worked out from the reference drilling alone: 129.5 N and 562 N/mm of feed for 3.2 mm
/// in cortex of 1850 mg/cm3 at 2 mm/s, the first with the area and the second with the diameter.
double lawByHand_N(double density, double feed_mm_s) {
  const double hard = density / 1850 * density / 1850, wide = 3.0 / 3.2;
  return hard * (129.5 * wide * wide + 562 * wide * feed_mm_s / (1000.0 / 60));
}

TEST(CoupledSession, FeelsWhatTheLawSaysInHomogeneousBoneWithoutRipple) {
  for (const double spacing : {0.2, 0.1, 0.05}) {
    Session session = coupled(layered(spacing, {{20, 300}}));
    std::vector<double> forces;
    for (int i = 0; i <= 12000; ++i) {
      const Output output = session.step(inputAt(static_cast<std::uint64_t>(i) * 1000, {0, 0, -0.5 + 0.001 * i}));
      if (i > 9000) forces.push_back(output.thrust_N);
    }
    double least = 1e9, most = 0, sum = 0;
    for (const double f : forces) least = std::min(least, f), most = std::max(most, f), sum += f;
    const double mean = sum / static_cast<double>(forces.size());
    // Besides the tip, the shaft rubs: at most all of its surface in the hole.
    const double rubbing = 0.05 * kPi * 3 * 7 * (300.0 / 1850) * (300.0 / 1850);
    EXPECT_GE(mean, lawByHand_N(300, 1.0) * 0.995);  // constants have three digits
    EXPECT_LE(mean, lawByHand_N(300, 1.0) * 1.005 + rubbing);
    EXPECT_LT(most - least, 0.02 * mean) << spacing;  // more shaft rubs as the hole gets deeper; nothing flickers
  }
}

TEST(CoupledSession, ReproducesTheDrillingOfHumanFemurCortex) {
  // MacAvelia 2012: a 3.2 mm surgical bit (118 degree point: the cone is 0.96 mm long) at 2 mm/s. A testing machine is
  // a hand that gives way to nothing. The law leaves 2.5 N of the published means and 0.5 N of rounded constants; 6 mm
  // of hole rub with at most 0.05 * pi * 3.2 * 6 = 3 N.
  const double rpm[] = {1000, 1250, 1500}, published_N[] = {198, 181, 176};
  for (int n = 0; n < 3; ++n) {
    Config config{{3.2, 0.96, 30}};
    config.speed_rpm = rpm[n];
    config.coupling = haptics::Coupling{2000, 0};
    Session session = Session::create(layered(0.2, {{10, 1850}}), config).value();
    double sum = 0;
    int count = 0;
    for (int i = 0; i <= 3500; ++i) {
      const Output output = session.step(inputAt(static_cast<std::uint64_t>(i) * 1000, {0, 0, -0.5 + 0.002 * i}));
      if (output.depth_mm > 2 && output.depth_mm < 6) sum += output.thrust_N, ++count;
    }
    ASSERT_GT(count, 1500);
    EXPECT_NEAR(sum / count, published_N[n], 2.5 + 0.5 + 3.0) << rpm[n] << " rpm";
  }
}

TEST(CoupledSession, PassesThroughCortexCancellousBoneAndCortexAgainAndBreaksThrough) {
  // A stiff hand at 1 mm/s, half a millimetre ahead at most: a softer one plunges through what lies behind a cortex.
  Session session = coupled(layered(0.1, {{1.5, 1100}, {10, 250}, {1.5, 1100}, {6, 0}}), {50, 0});
  double outer = 0, inside = 0, inner = 0, beyond = 0;
  for (int i = 0; i <= 23000; ++i) {
    const Output output = session.step(inputAt(static_cast<std::uint64_t>(i) * 1000, {0, 0, -1 + 0.001 * i}));
    const double depth = output.depth_mm, force = output.thrust_N;
    if (depth < 5) outer = std::max(outer, force);
    if (depth > 8 && depth < 11) inside = std::max(inside, force);  // the cone is 5 mm long, and past the cortex
    if (depth > 11.5 && depth < 17) inner = std::max(inner, force);
    if (depth > 18.5) beyond = std::max(beyond, force);
  }
  EXPECT_GT(outer, 10);
  EXPECT_LT(outer, 30) << "porcine vertebrae: 0.6 to 29.6 N";
  EXPECT_GT(inside, 0.6);
  EXPECT_LT(inside, 5);
  EXPECT_GT(inner, 5 * inside);
  // The shaft rubs in 3 mm of cortex and 10 mm of the inside: 0.05 * pi * 3 * (3 * 0.354 + 10 * 0.018) = 0.6 N; facets
  // of 6.6 mm2 may count one too many in each cortex, 0.12 N each.
  EXPECT_LT(beyond, 0.6 + 2 * 0.12);
}

/// Drives a hand's trace at `hz`; the depth reached and the mean force on the way.
struct Felt {
  double depth_mm, mean_N, peak_N;
};
Felt drive(double spacing, double hz) {
  Session session = coupled(layered(spacing, {{1.2, 1100}, {8, 250}, {1.2, 1100}, {3, 0}}));
  double sum = 0, peak = 0, depth = 0;
  const int cycles = static_cast<int>(9 * hz);
  for (int i = 0; i <= cycles; ++i) {
    const double t = i / hz;
    const double trembling = 0.05 * sinCos(2 * kPi * 9 * t).sin;
    const Vec3 tip{0.3 * trembling, 0.5 * trembling, -1 + 1.5 * t + trembling};
    const Output output = session.step(inputAt(static_cast<std::uint64_t>(t * 1e6 + 0.5), tip));
    sum += output.thrust_N, peak = std::max(peak, output.thrust_N), depth = output.depth_mm;
  }
  return {depth, sum / cycles, peak};
}

TEST(CoupledSession, ReachesTheSameDepthWithTheSameForceAtAnySpacing) {
  const Felt coarse = drive(0.2, 1000), middle = drive(0.1, 1000), fine = drive(0.05, 1000);
  RecordProperty("depth", std::to_string(coarse.depth_mm) + " " + std::to_string(middle.depth_mm) + " " +
                              std::to_string(fine.depth_mm));
  RecordProperty(
      "mean", std::to_string(coarse.mean_N) + " " + std::to_string(middle.mean_N) + " " + std::to_string(fine.mean_N));
  for (const Felt& felt : {coarse, middle}) {
    EXPECT_NEAR(felt.depth_mm, fine.depth_mm, 0.03 * fine.depth_mm);
    EXPECT_NEAR(felt.mean_N, fine.mean_N, 0.03 * fine.mean_N);
  }
  EXPECT_GT(fine.peak_N, 10);
  EXPECT_LT(fine.peak_N, 40);
}

TEST(CoupledSession, ReachesTheSameDepthAtAnyRate) {
  const Felt slow = drive(0.1, 300), fast = drive(0.1, 4000);
  EXPECT_NEAR(slow.depth_mm, fast.depth_mm, 0.03 * fast.depth_mm);
  EXPECT_NEAR(slow.mean_N, fast.mean_N, 0.03 * fast.mean_N);
}

bool standsInBone(const Session& session, const drill::BitPose& pose) {
  const auto table = point_volume::discTable(session.volume().lattice);
  const Lattice& lattice = session.volume().lattice;
  drill::BitShape shape = drill::shapeOf(kBit);
  for (std::uint32_t i = 0; i < lattice.points(); ++i) {
    if (!session.volume().isAlive(i)) continue;
    const std::uint32_t at = i % lattice.pointsPerDisc();
    const Vec3 point{table.x_mm[at], table.y_mm[at], lattice.discZ_mm(static_cast<int>(i / lattice.pointsPerDisc()))};
    if (drill::isInside(shape, pose.tip_mm, pose.axis, point)) return true;
  }
  return false;
}

TEST(CoupledSession, StopsBeforeBoneWhenTheBitDoesNotTurn) {
  Random random(21);
  for (int n = 0; n < 6; ++n) {
    const double spacing = n % 2 == 0 ? 0.2 : 0.1;
    Session session = coupled(layered(spacing, {{6, 250}}));
    const std::uint64_t before = point_volume::countAlive(session.volume());
    const double tilt = random.uniform(0, 0.3);
    Output output;
    for (int i = 0; i < 400; ++i) {
      // Slowly, then thrown: 30 mm in a millisecond.
      Input input = inputAt(static_cast<std::uint64_t>(i) * 1000, {0.2, -0.1, i < 200 ? -2 + 0.02 * i : 30}, false);
      input.axis = {tilt, 0, 1};
      output = session.step(input);
      ASSERT_EQ(output.removed, 0u);
    }
    EXPECT_EQ(point_volume::countAlive(session.volume()), before);
    EXPECT_FALSE(standsInBone(session, output.bit)) << n;
    // Only the apex gets between points: a circle between the points of a disc is at most 0.72 spacings wide, which the
    // cone of 3 / 10 reaches 2.4 spacings behind its apex.
    EXPECT_LT(output.depth_mm, 2.4 * spacing);
    EXPECT_GT(output.depth_mm, -2 * spacing - 0.2) << "stopped at the bone, not far before it";
    EXPECT_GT(output.thrust_N, 100) << "the spring is 30 mm long";
  }
}

TEST(CoupledSession, CutsEveryPointThatTheBitItselfWentThrough) {
  // Whatever the hand does: no alive point is inside the bit after a cycle in which it turns.
  Random random(22);
  Session session = coupled(layered(0.2, {{1, 900}, {8, 250}}, 4));
  for (int i = 0; i < 300; ++i) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1), z = random.uniform(-2, 9);
    Input input = inputAt(static_cast<std::uint64_t>(i) * 2000, {x, y, z});
    const double ax = random.uniform(-0.3, 0.3), ay = random.uniform(-0.3, 0.3);
    input.axis = {ax, ay, 1};
    const Output output = session.step(input);
    ASSERT_EQ(output.status, Status::Ok);
    if (i % 20 == 0) {
      ASSERT_FALSE(standsInBone(session, output.bit)) << i;
    }
  }
  EXPECT_LT(point_volume::countAlive(session.volume()), session.volume().lattice.points());
}

TEST(CoupledSession, LetsTheHoleGuideTheBit) {
  Session session = coupled(layered(0.1, {{20, 250}}, 4));
  std::uint64_t t = 0;
  for (int i = 0; i <= 10000; ++i) (void)session.step(inputAt(t += 1000, {0, 0, 0.001 * i}));
  // 10 N aside for half a second: the tip that would advance by millimetres stays within tenths.
  Output output;
  for (int i = 0; i < 500; ++i) output = session.step(inputAt(t += 1000, {2, 0, 10}));
  EXPECT_LT(std::abs(output.bit.tip_mm.x), 0.3);  // to either side: the hole is where it turns about
  EXPECT_LT(output.force_N.x, -5) << "and pushes back";
  Session open = coupled(layered(0.1, {{20, 250}}, 4));
  t = 0;
  for (int i = 0; i < 1000; ++i) output = open.step(inputAt(t += 1000, {2, 0, -12}));
  EXPECT_EQ(output.bit.tip_mm, (Vec3{2, 0, -12})) << "in the open it is where the hand is";
  EXPECT_EQ(norm(output.force_N), 0);
}

TEST(CoupledSession, PullsBackFreelyButForRubbing) {
  Session session = coupled(layered(0.1, {{20, 250}}));
  std::uint64_t t = 0;
  for (int i = 0; i <= 10000; ++i) (void)session.step(inputAt(t += 1000, {0, 0, 0.001 * i}));
  double hardest = 0;
  Output output;
  for (int i = 0; i < 3000; ++i) {
    output = session.step(inputAt(t += 1000, {0, 0, 10 - 0.005 * i}));
    if (i > 500) hardest = std::max(hardest, -output.thrust_N);
  }
  // At most the whole hole's wall: 0.05 N/mm2 * pi * 3 mm * 10 mm * (250/1850)^2.
  EXPECT_GT(hardest, 0);
  EXPECT_LE(hardest, 0.05 * kPi * 3 * 10 * (250.0 / 1850) * (250.0 / 1850));
  EXPECT_EQ(output.depth_mm, 10 - 0.005 * 2999) << "out of the hole it is where the hand is";
}

/// A hand that leans on the drill with a constant push; how deep it gets, and how fast.
struct Leant {
  double deepest_mm = 0;
  double fastest_mm_s = 0;  ///< from cycle to cycle, past the near cortex
};
Leant lean(const std::vector<Layer>& layers, double push_N, double seconds) {
  Session session = coupled(layered(0.1, layers), {2, 0});
  haptics::Hand hand({0.25, 0.01, 0});
  hand.place({0, 0, -0.5});
  Leant leant;
  Vec3 reaction;
  double before = -0.5;
  for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
    for (int k = 0; k < 20; ++k) hand.step({}, {0, 0, push_N}, reaction, 5e-5);
    const Output output = session.step(inputAt(static_cast<std::uint64_t>(i) * 1000, {0, 0, hand.at_mm().z}));
    reaction = {0, 0, output.force_N.z};
    leant.deepest_mm = std::max(leant.deepest_mm, output.depth_mm);
    if (output.depth_mm > 1 && output.depth_mm < 12) {
      leant.fastest_mm_s = std::max(leant.fastest_mm_s, (output.depth_mm - before) * 1000);
    }
    before = output.depth_mm;
  }
  return leant;
}

TEST(CoupledSession, PlungesWhereASoftInsideLetsGo) {
  // The same push: through the cortex of a healthy vertebra and of an osteoporotic one, half as thick, onto its inside.
  const double push_N = 25;
  const Leant healthy = lean({{1.2, 1000}, {18, 260}, {1.2, 1000}, {10, 0}}, push_N, 4);
  const Leant porous = lean({{0.6, 850}, {18, 125}, {0.6, 850}, {10, 0}}, push_N, 4);
  RecordProperty("healthy", std::to_string(healthy.fastest_mm_s));
  RecordProperty("porous", std::to_string(porous.fastest_mm_s));
  EXPECT_GT(porous.fastest_mm_s, 1.5 * healthy.fastest_mm_s);
  EXPECT_GT(porous.deepest_mm, 20) << "out of the far side";
}

TEST(CoupledSession, StandsOnCortexThatIsTooHardForThePush) {
  const Leant leant = lean({{6, 1250}, {6, 250}}, 8, 3);
  EXPECT_LT(leant.deepest_mm, 3) << "the cone gets in as far as its area allows, and no farther";
  EXPECT_GT(leant.deepest_mm, 0.2);
}

TEST(CoupledSession, GivesADefinedAnswerToAnyBits) {
  Session session = coupled(layered(0.2, {{8, 400}}, 3));
  Random random(23);
  const auto any = [&random] {
    switch (random.below(8)) {
      case 0: {
        const std::uint64_t bits = random.bits();
        double value = 0;
        static_assert(sizeof bits == sizeof value);
        __builtin_memcpy(&value, &bits, sizeof value);
        return value;
      }
      case 1:
        return std::numeric_limits<double>::denorm_min();
      case 2:
        return random.uniform(-1e6, 1e6);
      default:
        return random.uniform(-4, 8);
    }
  };
  std::uint64_t t = 0, removed = 0;
  int accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    Input input;
    t += random.below(4) == 0 ? 0 : random.below(200000);
    input.t_us = t;
    input.tip_mm.x = any(), input.tip_mm.y = any(), input.tip_mm.z = any();
    input.axis.x = any(), input.axis.y = any(), input.axis.z = any();
    input.spinning = random.below(4) != 0;
    const Output output = session.step(input);
    accepted += output.status == Status::Ok;
    removed += output.removed;
    ASSERT_TRUE(isFinite(output.force_N) && isFinite(output.torque_Nmm) && isFinite(output.bit.tip_mm)) << i;
    ASSERT_NEAR(norm(output.bit.axis), 1, 1e-12) << i;
  }
  EXPECT_GT(accepted, 5000);
  EXPECT_GT(removed, 1000u);
  EXPECT_EQ(session.volume().lattice.points() - point_volume::countAlive(session.volume()), removed);
}

TEST(CoupledSession, RefusesADriveOutOfRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, 1e7, nan}) {
    Config config{kBit};
    config.speed_rpm = bad;
    EXPECT_EQ(Session::create(layered(0.5, {{4, 300}}), config).error().code, ErrorCode::InvalidArgument);
    config.speed_rpm = 1000;
    config.coupling = haptics::Coupling{bad, 0};
    EXPECT_EQ(Session::create(layered(0.5, {{4, 300}}), config).error().code, ErrorCode::InvalidArgument);
    if (bad == 0) continue;
    config.coupling = haptics::Coupling{5, bad};
    EXPECT_EQ(Session::create(layered(0.5, {{4, 300}}), config).error().code, ErrorCode::InvalidArgument);
  }
}

}  // namespace
}  // namespace spinaltap::session
