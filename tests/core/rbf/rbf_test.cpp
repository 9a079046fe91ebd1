#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/rbf/rbf.h"
#include "core/rbf/solver.h"

namespace spinaltap::rbf {
namespace {

Vec3 randomPoint(Random& random, double half) {
  return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}

Vec3 randomDirection(Random& random) {
  while (true) {
    const Vec3 p = randomPoint(random, 1);
    if (norm(p) > 0.1 && norm(p) <= 1) return normalized(p);
  }
}

/// Signed distances to a sphere of radius 20: on it, 1 mm inside and 1 mm outside.
Samples sphere(std::size_t count, const Vec3& middle, std::uint64_t seed, double noise = 0) {
  Random random(seed);
  Samples s;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 d = randomDirection(random);
    const double error = noise * random.gaussian();
    for (const double offset : {0.0, 1.0, -1.0}) {
      s.positions.push_back(middle + d * (20 + offset + error));
      s.distances_mm.push_back(offset);
    }
  }
  return s;
}

double plainValue(const Model& m, const Vec3& point) {
  const Vec3 p = point - m.centroid_patient;
  long double sum = m.constant + dot(m.linear, p);
  for (std::size_t i = 0; i < m.centres.size(); ++i) sum += m.weights[i] * norm(p - m.centres[i]);
  return static_cast<double>(sum);
}

TEST(Fit, MeetsEverySampleExactlyWithoutToleranceAndSmoothing) {
  Random random(3);
  Samples s;
  for (int i = 0; i < 300; ++i) {
    s.positions.push_back(randomPoint(random, 30));
    s.distances_mm.push_back(random.uniform(-5, 5));
  }
  const auto fitted = fit(s, {.tolerance_mm = 0, .smoothing = 0, .max_centres = 300});
  ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
  EXPECT_EQ(fitted->report.centres, 300U);
  // Condition of 300 random centres: about 1e5, times 300 roundings of values up to 1e3.
  EXPECT_LT(fitted->report.residual_max_mm, 1e-8) << "seed 3";
}

TEST(Fit, WeightsAreOrthogonalToLinearPolynomials) {
  const auto fitted = fit(sphere(300, {5, 6, 7}, 4), {.tolerance_mm = 0.05, .smoothing = 0.1, .max_centres = 900});
  ASSERT_TRUE(fitted.has_value());
  double sum = 0;
  Vec3 moment;
  for (std::size_t i = 0; i < fitted->model.weights.size(); ++i) {
    sum += fitted->model.weights[i];
    moment += fitted->model.centres[i] * fitted->model.weights[i];
  }
  const double scale = fitted->report.sum_abs_weights * 40;
  EXPECT_LT(std::abs(sum), 1e-10 * scale);
  EXPECT_LT(norm(moment), 1e-10 * scale);
}

TEST(Fit, ReproducesALinearFunctionWithNoWeights) {
  Random random(5);
  Samples s;
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = randomPoint(random, 30);
    s.positions.push_back(p);
    s.distances_mm.push_back(2 + 0.3 * p.x - 0.2 * p.y + 0.9 * p.z);
  }
  const auto fitted = fit(s, {.tolerance_mm = 1e-6, .smoothing = 0, .max_centres = 100});
  ASSERT_TRUE(fitted.has_value());
  EXPECT_LT(fitted->report.sum_abs_weights, 1e-8);
  const Vec3 far[1] = {{1000, -1000, 500}};
  double value[1];
  evaluate(fitted->model, far, value);
  EXPECT_NEAR(value[0], 2 + 300 + 200 + 450, 1e-6);
}

TEST(Fit, NeedsFarFewerCentresThanSamplesAndSaysTheTruthAboutItsResiduals) {
  const Samples s = sphere(2000, {0, 0, 0}, 6);
  const auto fitted = fit(s, {.tolerance_mm = 0.1, .smoothing = 0, .max_centres = 2000});
  ASSERT_TRUE(fitted.has_value());
  EXPECT_TRUE(fitted->report.reached_tolerance);
  EXPECT_LE(fitted->report.residual_max_mm, 0.1);
  EXPECT_LT(fitted->report.centres, s.positions.size() / 5);
  double worst = 0, squares = 0;
  for (std::size_t i = 0; i < s.positions.size(); ++i) {
    const double e = plainValue(fitted->model, s.positions[i]) - s.distances_mm[i];
    worst = std::max(worst, std::abs(e)), squares += e * e;
  }
  EXPECT_NEAR(fitted->report.residual_max_mm, worst, 1e-9);
  EXPECT_NEAR(fitted->report.residual_rms_mm, std::sqrt(squares / static_cast<double>(s.positions.size())), 1e-9);
}

TEST(Fit, SaysSoWhenTheCentresRunOutBeforeTheTolerance) {
  const auto fitted = fit(sphere(500, {0, 0, 0}, 7), {.tolerance_mm = 1e-4, .smoothing = 0, .max_centres = 100});
  ASSERT_TRUE(fitted.has_value());
  EXPECT_EQ(fitted->report.centres, 100U);
  EXPECT_FALSE(fitted->report.reached_tolerance);
  EXPECT_GT(fitted->report.residual_max_mm, 1e-4);
}

TEST(Fit, SmoothingAveragesNoiseOutOfTheSurface) {
  const double noise = 0.2;
  const Samples s = sphere(3000, {0, 0, 0}, 8, noise);
  const auto rough = fit(s, {.tolerance_mm = 0.1, .smoothing = 0, .max_centres = 600});
  const auto smooth = fit(s, {.tolerance_mm = 0.1, .smoothing = 0.2, .max_centres = 600});
  ASSERT_TRUE(rough.has_value() && smooth.has_value());
  Random random(9);
  double rough_squares = 0, smooth_squares = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 p = randomDirection(random) * 20;
    rough_squares += std::pow(plainValue(rough->model, p), 2);
    smooth_squares += std::pow(plainValue(smooth->model, p), 2);
  }
  // 9000 samples over 600 centres: 15 noisy samples a centre, of 3 independent errors each 5: 0.2 / sqrt 5 = 0.09.
  EXPECT_LT(std::sqrt(smooth_squares / 1000), 0.1);
  EXPECT_LT(smooth_squares, 0.5 * rough_squares);
}

TEST(Fit, IsTheSameSurfaceAKilometreAway) {
  const Vec3 far{1e6, -1e6, 1e6};
  const FitOptions options{.tolerance_mm = 0.05, .smoothing = 0.1, .max_centres = 500};
  const auto near_fit = fit(sphere(800, {0, 0, 0}, 10), options);
  const auto far_fit = fit(sphere(800, far, 10), options);
  ASSERT_TRUE(near_fit.has_value() && far_fit.has_value());
  Random random(11);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = randomPoint(random, 25);
    // The samples themselves moved by the rounding of 1e6 (1.2e-10 mm); greedy may then choose other centres in a tie,
    // so the two agree to the tolerance and, near the data, usually far better.
    EXPECT_NEAR(plainValue(near_fit->model, p), plainValue(far_fit->model, far + p), norm(p) > 10 ? 0.1 : 1.0);
  }
}

TEST(Fit, CountsSamplesAtOnePlaceAsOneWithTheirMean) {
  Samples s = sphere(100, {0, 0, 0}, 12);
  const std::size_t before = s.positions.size();
  for (std::size_t i = 0; i < before; i += 3) {
    s.positions.push_back(s.positions[i] + Vec3{1e-6, 0, 0});
    s.distances_mm.push_back(s.distances_mm[i] + 0.5);
  }
  const auto fitted = fit(s, {.tolerance_mm = 0, .smoothing = 0, .max_centres = 10000});
  ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
  EXPECT_EQ(fitted->report.samples, before);
  // 1e-6 mm apart at a slope of at most 10.
  EXPECT_NEAR(plainValue(fitted->model, s.positions[0]), 0.25, 1e-5);
}

TEST(Fit, RefusesTooFewFlatAndBrokenSamples) {
  const FitOptions options;
  EXPECT_EQ(fit({}, options).error().code, ErrorCode::Degenerate);
  EXPECT_EQ(fit({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 0, 0}}, options).error().code, ErrorCode::Degenerate);
  EXPECT_EQ(fit({{{0, 0, 0}, {1, 0, 0}}, {0}}, options).error().code, ErrorCode::InvalidArgument);
  Samples flat, line, same;
  for (int i = 0; i < 50; ++i) {
    flat.positions.push_back({1.0 * (i % 7), 1.0 * (i / 7), 1.0 * (i % 7) + 3});
    line.positions.push_back({1.0 * i, 2.0 * i, -1.0 * i});
    same.positions.push_back({3, 3, 3});
  }
  flat.distances_mm = line.distances_mm = same.distances_mm = std::vector<double>(50, 0.0);
  EXPECT_NE(fit(flat, options).error().message.find("one plane"), std::string::npos);
  EXPECT_EQ(fit(line, options).error().code, ErrorCode::Degenerate);
  EXPECT_EQ(fit(same, options).error().code, ErrorCode::Degenerate);
  Samples nan = sphere(10, {0, 0, 0}, 13);
  nan.positions[17].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fit(nan, options).error().code, ErrorCode::NotFinite);
  EXPECT_NE(fit(nan, options).error().message.find("17"), std::string::npos);
  const Samples good = sphere(10, {0, 0, 0}, 13);
  EXPECT_EQ(fit(good, {.tolerance_mm = -1}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(fit(good, {.smoothing = -1}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(fit(good, {.max_centres = 3}).error().code, ErrorCode::InvalidArgument);
}

TEST(Fit, ReportsProgressThatNeverGoesBack) {
  double last = 0;
  const auto fitted = fit(sphere(300, {0, 0, 0}, 14), {}, [&last](double now) {
    EXPECT_GE(now, last);
    last = now;
  });
  ASSERT_TRUE(fitted.has_value());
  EXPECT_EQ(last, 1.0);
}

/// The slow twin: the whole saddle-point system at once, by LU with full pivoting.
TEST(GrowingSolver, GivesTheSolutionOfTheWholeSystemThoughItGrewInSteps) {
  Random random(15);
  const double ridge = 0.3;
  std::vector<Vec3> points;
  std::vector<double> values;
  for (int i = 0; i < 60; ++i) points.push_back(randomPoint(random, 10)), values.push_back(random.uniform(-1, 1));
  GrowingSolver solver(40, ridge, 60);
  for (std::size_t first = 0; first < 60; first += 15) {
    ASSERT_TRUE(solver.add(std::span(points).subspan(first, 15)).has_value());
  }
  const auto grown = solver.solve(values);
  ASSERT_TRUE(grown.has_value());

  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(64, 64);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(64);
  for (int i = 0; i < 60; ++i) {
    const Vec3& p = points[static_cast<std::size_t>(i)];
    for (int j = 0; j < 60; ++j) whole(i, j) = norm(p - points[static_cast<std::size_t>(j)]);
    whole(i, i) = -ridge;
    whole.block<1, 4>(i, 60) << 1, p.x, p.y, p.z;
    whole.block<4, 1>(60, i) << 1, p.x, p.y, p.z;
    right(i) = values[static_cast<std::size_t>(i)];
  }
  const Eigen::VectorXd x = whole.fullPivLu().solve(right);
  for (int i = 0; i < 60; ++i) EXPECT_NEAR(grown->weights[static_cast<std::size_t>(i)], x(i), 1e-10) << "seed 15";
  EXPECT_NEAR(grown->constant, x(60), 1e-9);
  EXPECT_NEAR(grown->linear.x, x(61), 1e-10);
  EXPECT_NEAR(grown->linear.z, x(63), 1e-10);
}

Model someModel(std::size_t centres, std::uint64_t seed) {
  Random random(seed);
  Model m;
  m.centroid_patient = {1e5, 2e5, -3e5};
  for (std::size_t i = 0; i < centres; ++i) {
    m.centres.push_back(randomPoint(random, 40));
    m.weights.push_back(random.uniform(-1, 1));
  }
  m.constant = 3;
  m.linear = {0.1, 0.2, -0.3};
  return m;
}

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
    evaluate(m, std::span(points).subspan(i, 1), alone);
    evaluateGradient(m, std::span(points).subspan(i, 1), gradient_alone);
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

TEST(Evaluate, AFieldOutlivesTheModelItWasMadeFrom) {
  Field field;
  double wanted = 0;
  const Vec3 p[1] = {{1e5, 2e5, -3e5}};
  {
    const Model m = someModel(50, 20);
    wanted = plainValue(m, p[0]);
    field = asField(m, 1.5);
  }
  double value[1];
  field.values(p, value);
  EXPECT_NEAR(value[0], wanted, 1e-11);
  EXPECT_EQ(field.lipschitz, 1.5);
}

}  // namespace
}  // namespace spinaltap::rbf
