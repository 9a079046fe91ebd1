#include "core/metrics/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/dmath.h"

namespace spinaltap::metrics {
namespace {

constexpr double kDegree = kPi / 180;

Plan plainPlan() { return {{3.0, 5.0, 50.0}, 30.0, {0.5, 8, 80, -4}, {}}; }

/// A path along `direction` from `entry`, in the patient.
Plan patientPlan(const Vec3& entry, const Vec3& direction, double length_mm) {
  plan::Path path;
  path.entry_patient = entry;
  path.target_patient = entry + direction * length_mm;
  path.volume_radius_mm = 4;
  path.spacing_mm = 0.5;
  return planOf(path);
}

/// A straight drill from `from` to `to` (path frame), `count` cycles of 1 ms, the bit along the way unless told
/// otherwise.
void drill(Accumulator& accumulator, const Vec3& from, const Vec3& to, int count, const Vec3* axis = nullptr) {
  for (int i = 0; i <= count; ++i) {
    Cycle cycle;
    cycle.t_us = static_cast<std::uint64_t>(1000 * i);
    cycle.tip_mm = from + (to - from) * (static_cast<double>(i) / count);
    cycle.axis = axis != nullptr ? *axis : to - from;
    accumulator.add(cycle);
  }
}

Field fieldOf(std::function<double(const Vec3&)> value) {
  Field field;
  field.values = [value](std::span<const Vec3> points, std::span<double> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = value(points[i]);
  };
  field.gradients = [value](std::span<const Vec3> points, std::span<Vec3> out) {
    constexpr double h = 1e-5;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto slope = [&](const Vec3& d) { return (value(points[i] + d * h) - value(points[i] - d * h)) / (2 * h); };
      out[i] = {slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1})};
    }
  };
  return field;
}

TEST(Metrics, OfADrillAlongThePathHaveNoErrors) {
  Accumulator accumulator(patientPlan({10, -20, 30}, normalized({0.3, -1, 0.1}), 30));
  drill(accumulator, {0, 0, -2}, {0, 0, 30}, 3200);
  const Metrics m = accumulator.finish();
  EXPECT_EQ(m.cycles, 3201u);
  EXPECT_NEAR(m.time_s, 3.2, 1e-12);
  EXPECT_NEAR(*m.depth_max_mm, 30, 1e-12);
  EXPECT_NEAR(*m.entry_error_mm, 0, 1e-12);
  EXPECT_NEAR(*m.tip_error_mm, 0, 1e-12);
  EXPECT_NEAR(*m.angle_error_deg, 0, 1e-9);
  EXPECT_NEAR(*m.axial_angle_error_deg, 0, 1e-9);
  EXPECT_NEAR(*m.sagittal_angle_error_deg, 0, 1e-9);
  EXPECT_FALSE(m.breach_mm.has_value()) << "nothing is known of the bone without a field";
}

TEST(Metrics, OfAParallelDrillAreItsOffsetAtBothEndsAndNoAngle) {
  Accumulator accumulator(plainPlan());
  drill(accumulator, {0.6, -0.8, -2}, {0.6, -0.8, 30}, 100);
  const Metrics m = accumulator.finish();
  EXPECT_NEAR(*m.entry_error_mm, 1, 1e-12);
  EXPECT_NEAR(*m.tip_error_mm, 1, 1e-12);
  EXPECT_NEAR(*m.angle_error_deg, 0, 1e-9);
  EXPECT_FALSE(m.axial_angle_error_deg.has_value()) << "without a patient there are no such planes";
}

TEST(Metrics, TheEntryIsWhereTheTipPassesItsPlaneBetweenTwoCycles) {
  Accumulator accumulator(plainPlan());
  drill(accumulator, {0, 0, -3}, {4, 0, 9}, 2);  // steps of (2, 0, 6): crosses z = 0 at x = 1
  EXPECT_NEAR(*accumulator.finish().entry_error_mm, 1, 1e-12);
}

TEST(Metrics, ADrillTooShortOrTooLongMissesTheTargetByThatMuch) {
  for (const double depth : {25.0, 33.0}) {
    Accumulator accumulator(plainPlan());
    drill(accumulator, {0, 0, 0}, {0, 0, depth}, 100);
    EXPECT_NEAR(*accumulator.finish().tip_error_mm, std::abs(depth - 30), 1e-12);
  }
}

TEST(Metrics, TheAxisOfADeepHoleIsTheLineOfTheTipAndOfAShallowOneTheBits) {
  const Vec3 tilted{std::sin(10 * kDegree), 0, std::cos(10 * kDegree)};
  Accumulator deep(plainPlan()), shallow(plainPlan());
  drill(deep, {0, 0, 0}, {0, 20 * std::tan(5 * kDegree), 20}, 100, &tilted);
  EXPECT_NEAR(*deep.finish().angle_error_deg, 5, 1e-9);
  drill(shallow, {0, 0, 0}, {0, 0, 0.5}, 100, &tilted);
  EXPECT_NEAR(*shallow.finish().angle_error_deg, 10, 1e-9);
}

TEST(Metrics, AnglesInThePatientsPlanesAreThoseOfTheProjections) {
  // The path runs to the front (-y). Turning it 6 degrees about z is axial only, about x sagittal only.
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 30);
  for (const auto& [turned, axial, sagittal] :
       {std::tuple{Vec3{std::sin(6 * kDegree), -std::cos(6 * kDegree), 0}, 6.0, 0.0},
        {Vec3{0, -std::cos(6 * kDegree), std::sin(6 * kDegree)}, 0.0, 6.0}}) {
    Accumulator accumulator(plan);
    drill(accumulator, {0, 0, 0}, plan.frame->directionToLocal(turned * 30), 100);
    const Metrics m = accumulator.finish();
    EXPECT_NEAR(*m.angle_error_deg, 6, 1e-9);
    EXPECT_NEAR(*m.axial_angle_error_deg, axial, 1e-9);
    EXPECT_NEAR(*m.sagittal_angle_error_deg, sagittal, 1e-9);
  }
}

TEST(Metrics, APathAtRightAnglesToAPlaneHasNoAngleInIt) {
  const Plan plan = patientPlan({0, 0, 0}, {0, 0, 1}, 30);
  Accumulator accumulator(plan);
  drill(accumulator, {0, 0, 0}, {1, 1, 30}, 100);
  const Metrics m = accumulator.finish();
  EXPECT_FALSE(m.axial_angle_error_deg.has_value());
  EXPECT_TRUE(m.sagittal_angle_error_deg.has_value());
}

TEST(Metrics, ForceAndFeedAreOverTheTimeOfCutting) {
  Accumulator accumulator(plainPlan());
  const std::uint32_t one[] = {0};
  // 0-1 s in air, cuts at 1 s (z = 1) and 3 s (z = 5), rests until 4 s. Thrust 2 N up to 2 s, 6 N up to 3 s, then 9 N.
  for (int i = 0; i <= 4; ++i) {
    Cycle cycle;
    cycle.t_us = static_cast<std::uint64_t>(1000000 * i);
    cycle.tip_mm = {0, 0, i < 3 ? static_cast<double>(i) : 5.0};
    cycle.thrust_N = i <= 2 ? 2 : i == 3 ? 6 : 9;
    if (i == 1 || i == 3) cycle.removed_indices = one;
    accumulator.add(cycle);
  }
  const Metrics m = accumulator.finish();
  EXPECT_EQ(m.time_s, 4);
  EXPECT_EQ(m.peak_thrust_N, 9);
  EXPECT_EQ(m.mean_thrust_N, (2.0 + 6.0) / 2);
  EXPECT_EQ(m.mean_feed_mm_per_s, (5.0 - 1.0) / 2);
  EXPECT_EQ(m.removed, 2u);
}

TEST(Metrics, BoneOutsideThePlanIsWhatTheBitAtTheTargetWouldHaveLeft) {
  const Plan plan = plainPlan();
  const auto disc = point_volume::discTable(plan.lattice);
  Accumulator accumulator(plan);
  std::vector<std::uint32_t> all;
  std::uint64_t outside = 0;
  for (std::uint32_t i = 0; i < plan.lattice.points(); ++i) {
    all.push_back(i);
    const std::uint32_t in_disc = i % plan.lattice.pointsPerDisc();
    const double z = plan.lattice.discZ_mm(static_cast<int>(i / plan.lattice.pointsPerDisc()));
    const double r = std::hypot(disc.x_mm[in_disc], disc.y_mm[in_disc]);
    const double allowed = z <= 25 ? 1.5 : 1.5 * (30 - z) / 5;  // the ring at 1.5 mm belongs to the hole
    outside += z > 30 || r > allowed + 1e-9 ? 1 : 0;
  }
  Cycle cycle;
  cycle.removed_indices = all;
  accumulator.add(cycle);
  const Metrics m = accumulator.finish();
  EXPECT_EQ(m.removed_outside_plan, outside);
  EXPECT_NEAR(m.removed_mm3, static_cast<double>(all.size()) * kPi / 3 * 0.125, 1e-9);
  EXPECT_NEAR(m.removed_outside_plan_mm3, static_cast<double>(outside) * kPi / 3 * 0.125, 1e-9);
}

TEST(Metrics, AStoppedBitMakesNoHole) {
  Accumulator accumulator(plainPlan());
  for (int i = 0; i < 10; ++i)
    accumulator.add({static_cast<std::uint64_t>(i), {0, 0, 1.0 * i}, {0, 0, 1}, false, 0, {}});
  const Metrics m = accumulator.finish();
  EXPECT_FALSE(m.depth_max_mm.has_value());
  EXPECT_FALSE(m.tip_error_mm.has_value());
}

// A pedicle as a cylinder of 4 mm radius along -y (to the front) around the path, without ends.
double pedicle(const Vec3& p) { return std::hypot(p.x, p.z) - 4.0; }

struct Shift {
  Vec3 patient;  ///< of the hole, across the path
  double breach_mm;
  Direction direction;
};

TEST(Breach, OfACylindricalPedicleIsShiftPlusBitRadiusMinusPedicleRadius) {
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 30);
  const Field field = fieldOf(pedicle);
  for (const Shift& shift : {Shift{{2, 0, 0}, 0, Direction::None},
                             {{4, 0, 0}, 1.5, Direction::Medial},
                             {{-4, 0, 0}, 1.5, Direction::Lateral},
                             {{0, 0, 5.5}, 3.0, Direction::Cranial},
                             {{0, 0, -7}, 4.5, Direction::Caudal}}) {
    Accumulator accumulator(plan);
    const Vec3 across = plan.frame->directionToLocal(shift.patient);
    drill(accumulator, across + Vec3{0, 0, -2}, across + Vec3{0, 0, 30}, 3200);
    const Metrics m = accumulator.finish(&field, 1);
    // 24 points a ring: the one nearest the outermost is at most 7.5 degrees away, 1.5 mm * (1 - cos 7.5 deg) = 0.013
    // mm.
    EXPECT_NEAR(*m.breach_mm, shift.breach_mm, 0.013) << nameOf(shift.direction);
    EXPECT_EQ(m.breach_direction, shift.direction);
    EXPECT_EQ(*m.plunge_mm, 0);
  }
}

TEST(Breach, MedialIsWhereThePathConvergesUnlessTold) {
  const Field field = fieldOf([](const Vec3& p) { return p.x - 1.0 - 0.25 * p.y * -1.0; });  // open toward +x
  for (const int side : {0, 1, -1}) {
    const Plan plan = patientPlan({0, 0, 0}, normalized({0.25, -1, 0}), 30);
    Accumulator accumulator(plan);
    drill(accumulator, {0, 0, 0}, {0, 0, 30}, 3000);
    const Metrics m = accumulator.finish(&field, side);
    EXPECT_EQ(m.breach_direction, side == -1 ? Direction::Lateral : Direction::Medial);
  }
}

TEST(Breach, OfATiltedHoleGrowsWithItsDepth) {
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 30);
  const Field field = fieldOf(pedicle);
  const double angle = 10 * kDegree;
  const Vec3 axis = plan.frame->directionToLocal({std::sin(angle), -std::cos(angle), 0});
  Accumulator accumulator(plan);
  drill(accumulator, {0, 0, 0}, axis * 30, 3000);
  const Metrics m = accumulator.finish(&field, 1);
  // Farthest out is the cylinder's end, 5 mm behind the tip: 25 sin 10 + 1.5 cos 10 - 4 mm; half way up the cone
  // 27.5 sin 10 + 0.75 cos 10 - 4 mm is less. Rings stand 1 mm (0.25 at the deepest) apart along the bit.
  const double expected = 25 * std::sin(angle) + 1.5 * std::cos(angle) - 4;
  EXPECT_NEAR(*m.breach_mm, expected, 0.25 * std::sin(angle) + 0.03);
  EXPECT_EQ(m.breach_direction, Direction::Medial);
}

TEST(Breach, TheRimOfTheEntryOnSlopingBoneIsNone) {
  // Bone below a plane that slopes 40 degrees against the path; the path enters it at right depth.
  const double slope = 40 * kDegree;
  const Vec3 outward{std::sin(slope), std::cos(slope), 0};
  const Field field = fieldOf([&](const Vec3& p) { return dot(p, outward); });
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 30);
  Accumulator accumulator(plan);
  drill(accumulator, {0, 0, -3}, {0, 0, 30}, 3300);
  const Metrics m = accumulator.finish(&field, 1);
  EXPECT_EQ(*m.breach_mm, 0);
  EXPECT_EQ(gertzbeinRobbins(*m.breach_mm), 'A');
}

TEST(Plunge, ThroughASlabIsWhatTheTipWentBeyondItsFarFace) {
  // Bone from y = 0 to y = -25; drilled to 30: 5 mm beyond. Then pulled back: what happened stays.
  const Field field = fieldOf([](const Vec3& p) { return std::max(p.y, -25 - p.y); });
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 30);
  Accumulator accumulator(plan);
  drill(accumulator, {0, 0, -1}, {0, 0, 30}, 3100);
  EXPECT_NEAR(*accumulator.finish(&field, 1).plunge_mm, 5, 0.05 + 1e-9) << "a march of 0.05 mm";
  EXPECT_EQ(*accumulator.finish(&field, 1).breach_mm, 0) << "straight ahead is not sideways";
  drill(accumulator, {0, 0, 30}, {0, 0, 10}, 2000);
  EXPECT_NEAR(*accumulator.finish(&field, 1).plunge_mm, 5, 0.05 + 1e-9);
  Accumulator careful(plan);
  drill(careful, {0, 0, -1}, {0, 0, 24}, 2500);
  EXPECT_EQ(*careful.finish(&field, 1).plunge_mm, 0);
}

TEST(Plunge, IntoTheBoneOfTheOtherSideIsStillAllOfTheWayBetween) {
  // Bone to 10 mm, none to 30, bone to 40: as through a pedicle, the canal and the other pedicle. Beside the way out at
  // 45 mm stands more of it, so that there the nearest bone is across the bit.
  const Field field = fieldOf([](const Vec3& p) {
    const double near = std::max(p.y, -10 - p.y), far = std::max(p.y + 30, -40 - p.y), beside = 2.5 - p.x;
    return std::min({near, far, beside});
  });
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 45);
  Accumulator accumulator(plan);
  drill(accumulator, {0, 0, -1}, {0, 0, 45}, 4600);
  // The poses kept are 0.25 mm apart, so the last before the far bone may be so much before it.
  const double plunge = *accumulator.finish(&field, 1).plunge_mm;
  EXPECT_LE(plunge, 20 + 0.05 + 1e-9);
  EXPECT_GT(plunge, 20 - 0.25 - 0.05);
  Accumulator shorter(plan);
  drill(shorter, {0, 0, -1}, {0, 0, 14}, 1500);
  EXPECT_NEAR(*shorter.finish(&field, 1).plunge_mm, 4, 0.05 + 1e-9);
}

TEST(Plunge, OutOfTheBoneSidewaysIsNone) {
  // Along the face of a slab, and out of it at 20 degrees: the bone's surface runs along the hole.
  const double slope = 20 * kDegree;
  const Vec3 outward{std::cos(slope), -std::sin(slope), 0};
  const Field field = fieldOf([&](const Vec3& p) { return dot(p, outward) - 3; });
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 30);
  Accumulator accumulator(plan);
  drill(accumulator, {0, 0, -1}, {0, 0, 30}, 3100);
  const Metrics m = accumulator.finish(&field, 1);
  EXPECT_EQ(*m.plunge_mm, 0);
  EXPECT_GT(*m.breach_mm, 6);
}

TEST(Accumulator, KeepsBoundedPosesOfALongWanderingDrillAndStillFindsTheBreach) {
  const Plan plan = patientPlan({0, 0, 0}, {0, -1, 0}, 30);
  const Field field = fieldOf(pedicle);
  Accumulator accumulator(plan);
  const Vec3 out = plan.frame->directionToLocal({4, 0, 0});
  for (int i = 0; i < 200000; ++i) {  // 20 times in and out, 600 mm in all
    const double z = 29.5 * std::abs(std::sin(i * 3e-4));
    accumulator.add({static_cast<std::uint64_t>(i) * 1000, out + Vec3{0, 0, z}, {0, 0, 1}, true, 0, {}});
  }
  EXPECT_NEAR(*accumulator.finish(&field, 1).breach_mm, 1.5, 0.02);
}

TEST(GertzbeinRobbins, GradesByTwoMillimetres) {
  EXPECT_EQ(gertzbeinRobbins(0), 'A');
  EXPECT_EQ(gertzbeinRobbins(0.1), 'B');
  EXPECT_EQ(gertzbeinRobbins(1.99), 'B');
  EXPECT_EQ(gertzbeinRobbins(2), 'C');
  EXPECT_EQ(gertzbeinRobbins(4), 'D');
  EXPECT_EQ(gertzbeinRobbins(5.99), 'D');
  EXPECT_EQ(gertzbeinRobbins(6), 'E');
}

TEST(Named, KeepsItsOrderAndLeavesOutWhatIsNotKnown) {
  Metrics m;
  m.cycles = 3, m.time_s = 0.002, m.removed = 986958, m.peak_thrust_N = 0.1;
  EXPECT_EQ(toJson(named(m)),
            "{\"cycles\":3,\"time_s\":0.002,\"removed\":986958,\"removed_mm3\":0,\"removed_outside_plan_mm3\":0,"
            "\"peak_thrust_N\":0.1,\"mean_thrust_N\":0,\"mean_feed_mm_per_s\":0}");
  m.breach_mm = 2.5, m.breach_direction = Direction::Medial, m.plunge_mm = 1.0 / 3;
  const std::string json = toJson(named(m));
  EXPECT_NE(json.find("\"breach_mm\":2.5,\"breach_direction\":\"medial\",\"gertzbein_robbins\":\"C\","
                      "\"plunge_mm\":0.3333333333333333}"),
            std::string::npos)
      << json;
}

TEST(ToJson, WritesNumbersInTheFewestDigitsAndNoNumbersAsNull) {
  EXPECT_EQ(toJson({{"a", 1e-300}, {"b", -0.0}, {"c", std::numeric_limits<double>::quiet_NaN()}, {"d", 1e15}}),
            "{\"a\":1e-300,\"b\":0,\"c\":null,\"d\":1e+15}");
}

}  // namespace
}  // namespace spinaltap::metrics
