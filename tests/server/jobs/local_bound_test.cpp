#include "server/jobs/local_bound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/plan/path.h"
#include "core/point_volume/point_volume.h"
#include "server/jobs/codec.h"

namespace spinaltap::jobs {
namespace {

/// A sphere of 12 mm, fitted: slope near 1 at its surface, folded at its middle, weights of both signs.
rbf::Model sphere(std::uint64_t seed) {
  Random random(seed);
  rbf::Samples samples;
  const Vec3 middle{1000, -2000, 300};
  for (int i = 0; i < 400; ++i) {
    const Vec3 out = normalized({random.gaussian(), random.gaussian(), random.gaussian()});
    for (const double distance_mm : {-1.0, 0.0, 1.0}) {
      samples.positions.push_back(middle + out * (12 + distance_mm));
      samples.distances_mm.push_back(distance_mm);
    }
  }
  return rbf::fit(samples, {.smoothing = 0.05, .reduce_mm = 0.05}).value().model;
}

plan::Path pathInto(const Vec3& middle) {
  plan::Path path;
  path.entry_patient = middle + Vec3{2, 12, 3};
  path.target_patient = middle + Vec3{-1, -6, -2};
  path.spacing_mm = 0.25;
  path.lead_mm = 2;
  return path;
}

TEST(LocalBound, HoldsBetweenRandomPointsAndForRandomSlopes) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const rbf::Model model = sphere(seed);
    const Cylinder cylinder{plan::pathFrame(pathInto({1000, -2000, 300})), 4, -2, 19};
    const double bound = lipschitzIn(model, cylinder);
    Random random(100 + seed);
    std::vector<Vec3> points;
    for (int i = 0; i < 20'000; ++i) {
      const Vec3 at{random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-2, 19)};
      if (std::hypot(at.x, at.y) <= 4) points.push_back(cylinder.frame.toPatient(at));
    }
    std::vector<double> values(points.size());
    std::vector<Vec3> slopes(points.size());
    rbf::evaluate(model, points, values);
    rbf::evaluateGradient(model, points, slopes);
    double steepest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      steepest = std::max(steepest, norm(slopes[i]));
      if (i == 0) continue;
      ASSERT_LE(std::abs(values[i] - values[i - 1]), bound * norm(points[i] - points[i - 1])) << "seed " << seed;
    }
    EXPECT_LE(steepest, bound) << "seed " << seed;
    EXPECT_LT(bound, lipschitzOf(model)) << "else it is of no use";
    for (const unsigned threads : {1U, 3U}) EXPECT_EQ(lipschitzIn(model, cylinder, threads), bound) << "seed " << seed;
  }
}

TEST(LocalBound, GivesTheSamePointsAsEvaluatingEveryOne) {
  const rbf::Model model = sphere(7);
  const plan::Path path = pathInto({1000, -2000, 300});
  const auto lattice = point_volume::latticeOf(path);
  const Frame frame = plan::pathFrame(path);
  const auto hu = [](std::span<const Vec3>, std::span<double> out) { std::fill(out.begin(), out.end(), 300.0); };
  const double bound = lipschitzIn(model, {frame, 4.25, -3, 20});
  const auto quick = point_volume::buildVolume(lattice, frame, rbf::asField(model, bound), hu).value();
  const auto slow =
      point_volume::buildVolume(lattice, frame, rbf::asField(model, std::numeric_limits<double>::infinity()), hu)
          .value();
  EXPECT_EQ(quick.alive, slow.alive);
  EXPECT_GT(point_volume::countAlive(quick), lattice.points() / 2);
  EXPECT_LT(point_volume::countAlive(quick), lattice.points());
}

TEST(LocalBound, OfAPlaneIsItsSlope) {
  rbf::Model plane;
  plane.linear = {0.6, 0, -0.8};
  EXPECT_NEAR(lipschitzIn(plane, {Frame{}, 4, 0, 10}), 1.0, 1e-5);
}

}  // namespace
}  // namespace spinaltap::jobs
