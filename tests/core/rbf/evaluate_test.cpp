#include <gtest/gtest.h>

#include "tests/core/rbf/sets.h"

namespace spinaltap::rbf {
namespace {

TEST(Evaluate, GivesTheSameBitsInAnyBatchWithAnyNumberOfThreads) {
  const Model m = someModel(1000, 16);
  Random random(17);
  std::vector<Vec3> points;
  for (int i = 0; i < 5003; ++i) points.push_back(m.centroid_patient + randomPoint(random, 50));
  std::vector<double> together(points.size());
  std::vector<Vec3> gradients(points.size());
  evaluate(m, points, together);
  evaluateGradient(m, points, gradients);
  for (std::size_t i = 0; i < points.size(); i += 97) {
    double alone[1];
    Vec3 gradient_alone[1];
    evaluate(m, std::span(points).subspan(i, 1), alone, 1);
    evaluateGradient(m, std::span(points).subspan(i, 1), gradient_alone, 1);
    EXPECT_EQ(alone[0], together[i]);
    EXPECT_EQ(gradient_alone[0], gradients[i]);
    // 1000 terms up to 140, each rounded once or twice: 1000 * 140 * 2.2e-16.
    EXPECT_NEAR(together[i], plainValue(m, points[i]), 4e-11);
  }
}

TEST(Evaluate, TheGradientIsTheSlopeAndIsFiniteOnACentre) {
  const Model m = someModel(200, 18);
  Random random(19);
  for (int i = 0; i < 100; ++i) {
    const Vec3 p[1] = {m.centroid_patient + randomPoint(random, 50)};
    Vec3 g[1];
    evaluateGradient(m, p, g);
    const double h = 1e-4;
    const double slope = (plainValue(m, p[0] + Vec3{0, h, 0}) - plainValue(m, p[0] - Vec3{0, h, 0})) / (2 * h);
    EXPECT_NEAR(g[0].y, slope, 1e-4) << "seed 19, case " << i;
  }
  const Vec3 centre[1] = {m.centroid_patient + m.centres[7]};
  Vec3 g[1];
  evaluateGradient(m, centre, g);
  EXPECT_TRUE(isFinite(g[0]));
}

TEST(Evaluator, StaysWithinItsToleranceOfTheOracleForValuesAndTheirSlopes) {
  const Samples s = sphere(900, {10, 20, 30}, 23, 0.05);
  const Model m = fit(s, {.tolerance_mm = 0.01}).value().model;
  Random random(24);
  std::vector<Vec3> points;
  for (int i = 0; i < 3000; ++i) points.push_back(Vec3{10, 20, 30} + randomPoint(random, 25));
  for (int i = 0; i < 200; ++i) points.push_back(s.positions[static_cast<std::size_t>(i)]);           // on centres
  for (int i = 0; i < 50; ++i) points.push_back(randomDirection(random) * random.uniform(1e3, 1e7));  // far away
  for (int i = 0; i < 3000; ++i) points.push_back(Vec3{10, 20, 30} + randomPoint(random, 60));        // around
  std::vector<double> direct(points.size()), fast(points.size());
  std::vector<Vec3> direct_slope(points.size()), fast_slope(points.size());
  evaluate(m, points, direct);
  evaluateGradient(m, points, direct_slope);
  for (const double tolerance : {1e-2, 1e-4, 1e-7}) {
    const Evaluator evaluator(m, tolerance);
    evaluator.values(points, fast);
    evaluator.gradients(points, fast_slope);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_NEAR(fast[i], direct[i], tolerance) << "seed 24, point " << i;
      ASSERT_TRUE(isFinite(fast_slope[i]));
      if (i >= 3000 && i < 3200) continue;  // a centre's own direction turns about there
      // An error that varies over the smallest cubes, some 3 mm, with polynomials of degree up to 7.
      ASSERT_LT(norm(fast_slope[i] - direct_slope[i]), tolerance * 49 / 1.5 + 1e-6) << "seed 24, point " << i;
    }
  }
}

TEST(Evaluator, IsFastAsFarAsFourRadiiAndTheOracleItselfBeyond) {
  Model m = someModel(1000, 26);
  m.radius_mm = 70;  // of a ball around a cube of half side 40: the cube that is prepared for has 50
  m.constant = 1e6;  // else the bound beyond the ball hides the sums
  const Evaluator evaluator(m, 1e-2);
  struct Shell {
    double from_mm, to_mm;
    bool fast;
  };
  Random random(27);
  for (const Shell& shell : {Shell{0, 50, true}, Shell{90, 279, true}, Shell{281, 1e6, false}}) {
    std::vector<Vec3> points;
    for (int i = 0; i < 5000; ++i)
      points.push_back(m.centroid_patient + randomDirection(random) * random.uniform(shell.from_mm, shell.to_mm));
    std::vector<double> direct(points.size()), fast(points.size());
    evaluate(m, points, direct);
    evaluator.values(points, fast);
    std::size_t equal = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_NEAR(fast[i], direct[i], 1e-2) << "seed 27, point " << i << " from " << shell.from_mm << " mm";
      equal += fast[i] == direct[i] ? 1 : 0;
    }
    // What polynomials tell has other last bits than what is summed.
    EXPECT_EQ(equal > points.size() / 2, !shell.fast) << equal << " equal, from " << shell.from_mm << " mm";
    if (!shell.fast) {
      EXPECT_EQ(equal, points.size());
    }
  }
}

TEST(Evaluate, FarAwayIsOutsideAlways) {
  // A hollow half: nothing but a strip of samples, whose linear part points inward on one side for ever.
  Random random(25);
  Samples s;
  for (int i = 0; i < 900; ++i) {
    const Vec3 d = randomDirection(random);
    if (d.x < 0.3) continue;
    for (const double offset : {0.0, 1.0, -1.0})
      s.positions.push_back(d * (20 + offset)), s.distances_mm.push_back(offset);
  }
  const Model m = fit(s, {.tolerance_mm = 0.01}).value().model;
  Model unbounded = m;
  unbounded.radius_mm = 0;
  int inside_without = 0;
  std::vector<Vec3> points;
  for (int i = 0; i < 500; ++i)
    points.push_back(m.centroid_patient +
                     randomDirection(random) * (m.radius_mm * std::pow(10.0, random.uniform(0.01, 9))));
  std::vector<double> values(points.size()), unguarded(points.size());
  std::vector<Vec3> slopes(points.size());
  evaluate(m, points, values);
  evaluateGradient(m, points, slopes);
  evaluate(unbounded, points, unguarded);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_GT(values[i], 0);
    EXPECT_TRUE(isFinite(slopes[i]));
    inside_without += unguarded[i] < 0 ? 1 : 0;
  }
  EXPECT_GT(inside_without, 0) << "the bound has nothing to do here";
}

TEST(Evaluate, AFieldOutlivesTheModelItWasMadeFrom) {
  Field direct, fast;
  double wanted = 0;
  const Vec3 p[1] = {{1e5, 2e5, -3e5}};
  {
    const Model m = someModel(50, 20);
    wanted = plainValue(m, p[0]);
    direct = asField(m, 1.5), fast = asField(m, 0.5, 1e-3);
  }
  double value[1];
  direct.values(p, value);
  EXPECT_NEAR(value[0], wanted, 1e-11);
  fast.values(p, value);
  EXPECT_NEAR(value[0], wanted, 1e-3);
  EXPECT_EQ(direct.lipschitz, 1.5);
  EXPECT_EQ(fast.lipschitz, 1.0) << "the bound far away has slope 1";
}

}  // namespace
}  // namespace spinaltap::rbf
