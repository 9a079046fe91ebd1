#include <gtest/gtest.h>

#include <limits>

#include "core/rbf/smoothing.h"
#include "core/rbf/system.h"
#include "tests/core/rbf/sets.h"

namespace spinaltap::rbf {
namespace {

Samples randomSamples(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Samples s;
  for (std::size_t i = 0; i < count; ++i) {
    s.positions.push_back(randomPoint(random, 30));
    s.distances_mm.push_back(random.uniform(-5, 5));
  }
  return s;
}

TEST(Fit, MeetsEverySampleDirectlyAndIteratively) {
  // 300 samples are solved directly, 2,700 by search directions.
  for (const std::size_t count : {300UL, 2700UL}) {
    const Samples s = count == 300 ? randomSamples(count, 3) : sphere(count / 3, {1, 2, 3}, 3);
    const auto fitted = fit(s, {.tolerance_mm = 1e-4});
    ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
    EXPECT_EQ(fitted->report.centres, count);
    EXPECT_EQ(fitted->report.rounds > 0, count > System::kDirect);
    EXPECT_LT(plainResiduals(fitted->model, s).largest, 1e-4 * 1.1) << "seed 3";  // fast sums are checked to a tenth
  }
}

TEST(Fit, IterativelyFindsWhatTheDirectSolverFinds) {
  const Samples s = sphere(900, {0, 0, 0}, 21, 0.1);  // 2,700
  for (const double ridge : {0.0, 0.3}) {
    const auto fitted = fit(s, {.tolerance_mm = 1e-6, .smoothing = ridge});
    ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
    const auto direct = DenseSystem<double>::make(s.positions, ridge, 2);
    std::vector<double> weights(s.positions.size());
    const Polynomial p = direct->solve(s.distances_mm, weights);
    Model whole;
    whole.centres = s.positions;
    for (const double u : weights) whole.weights.push_back(-u);
    whole.constant = p[0], whole.linear = {p[1], p[2], p[3]};
    Random random(22);
    for (int i = 0; i < 200; ++i) {
      const Vec3 at = randomDirection(random) * random.uniform(17, 20.9);
      // Both meet the samples within 1e-6; between samples a millimetre apart noise of that size grows little.
      EXPECT_NEAR(plainValue(fitted->model, at), plainValue(whole, at), 1e-5) << "ridge " << ridge;
    }
  }
}

TEST(Fit, WeightsAreOrthogonalToLinearPolynomials) {
  const auto fitted = fit(sphere(900, {5, 6, 7}, 4), {.tolerance_mm = 0.01, .smoothing = 0.1});
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
  for (const int count : {200, 2700}) {
    Samples s;
    for (int i = 0; i < count; ++i) {
      const Vec3 p = randomPoint(random, 30);
      s.positions.push_back(p);
      s.distances_mm.push_back(2 + 0.3 * p.x - 0.2 * p.y + 0.9 * p.z);
    }
    const auto fitted = fit(s, {.tolerance_mm = 1e-6});
    ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
    const Vec3 at[1] = {{10, -20, 5}};
    double value[1];
    evaluate(fitted->model, at, value);
    EXPECT_NEAR(value[0], 2 + 3 + 4 + 4.5, 1e-5) << count;
  }
}

TEST(Fit, ReportsItsResidualsAsDirectSummationFindsThem) {
  for (const double reduce : {0.0, 0.05}) {
    const Samples s = sphere(900, {0, 0, 0}, 6, 0.05);
    const auto fitted = fit(s, {.tolerance_mm = 0.01, .smoothing = 0.2, .reduce_mm = reduce});
    ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
    const Residuals r = plainResiduals(fitted->model, s);
    EXPECT_EQ(fitted->report.residual_samples, s.positions.size());
    EXPECT_NEAR(fitted->report.residual_max_mm, r.largest, 1e-9);
    EXPECT_NEAR(fitted->report.residual_rms_mm, r.rms, 1e-9);
  }
}

TEST(Fit, ReducesToFarFewerCentresThatStayWithinTheStatedDistanceOfTheWholeFit) {
  const Samples s = sphere(2000, {0, 0, 0}, 7, 0.1);
  const auto whole = fit(s, {.tolerance_mm = 0.002, .smoothing = kAutoSmoothing});
  const auto reduced = fit(s, {.tolerance_mm = 0.002, .smoothing = kAutoSmoothing, .reduce_mm = 0.05});
  ASSERT_TRUE(whole.has_value() && reduced.has_value());
  EXPECT_LT(reduced->report.centres, s.positions.size() / 3);
  EXPECT_LE(reduced->report.reduction_max_mm, 0.05);
  double most = 0;
  for (const Vec3& p : s.positions)
    most = std::max(most, std::abs(plainValue(whole->model, p) - plainValue(reduced->model, p)));
  // The whole fit behind the reduction was only solved to a fifth of what the reduction allows.
  EXPECT_LT(most, 0.05 + 0.01 + 0.002);
}

TEST(Fit, EstimatesTheNoiseAndSmoothsByIt) {
  for (const double noise : {0.05, 0.2}) {
    const Samples s = sphere(3000, {0, 0, 0}, 8, noise);
    const auto rough = fit(s, {.tolerance_mm = 0.01});
    const auto smooth = fit(s, {.tolerance_mm = 0.01, .smoothing = kAutoSmoothing});
    ASSERT_TRUE(rough.has_value() && smooth.has_value());
    // One error moves three samples: 21 independent ones in 64 less some seven coefficients, over 54: 0.88, and the
    // median of so few scatters by some percent.
    EXPECT_NEAR(smooth->report.noise_mm, noise, 0.2 * noise);
    EXPECT_NEAR(smooth->report.residual_rms_mm, smooth->report.noise_mm, 0.2 * noise);
    EXPECT_GT(smooth->report.smoothing, 0);
    Random random(9);
    double rough_squares = 0, smooth_squares = 0;
    for (int i = 0; i < 1000; ++i) {
      const Vec3 p = randomDirection(random) * 20;
      rough_squares += std::pow(plainValue(rough->model, p), 2),
          smooth_squares += std::pow(plainValue(smooth->model, p), 2);
    }
    EXPECT_LT(smooth_squares, 0.25 * rough_squares) << noise;
  }
}

TEST(Fit, LeavesSmoothSamplesAsTheyAre) {
  const auto fitted = fit(sphere(1500, {0, 0, 0}, 10), {.tolerance_mm = 0.01, .smoothing = kAutoSmoothing});
  ASSERT_TRUE(fitted.has_value());
  // Over the 3.3 mm of a neighbourhood and 1 mm to either side, the distance to a sphere of 20 mm has a cubic part of
  // r^2 z / (2 R^2) = 0.014 mm, which a quadratic takes for noise.
  EXPECT_LT(fitted->report.residual_rms_mm, 0.014);
}

TEST(Fit, IsTheSameSurfaceWhereverItsOriginAndWhateverItsUnit) {
  const FitOptions options{.tolerance_mm = 1e-3, .smoothing = 0.1};
  const auto here = fit(sphere(900, {0, 0, 0}, 11), options);
  ASSERT_TRUE(here.has_value());
  struct Place {
    Vec3 origin;
    double unit;
  };
  for (const Place place :
       {Place{{1e8, -1e8, 1e8}, 1}, Place{{0, 0, 0}, 1e-3}, Place{{0, 0, 0}, 1e3}, Place{{5e4, 0, 0}, 1e-6}}) {
    const auto there = fit(sphere(900, place.origin, 11, 0, place.unit),
                           {.tolerance_mm = 1e-3 * place.unit, .smoothing = 0.1 * place.unit});
    ASSERT_TRUE(there.has_value()) << there.error().message;
    Random random(12);
    for (int i = 0; i < 100; ++i) {
      const Vec3 p = randomDirection(random) * random.uniform(18, 20.9);
      // The samples themselves are rounded to the origin's last digit (1.5e-8 at 1e8; 7e-12 at 5e4, seven units of 1e-6
      // of a millionth): both fits come within the tolerance of nearly the same numbers.
      EXPECT_NEAR(plainValue(there->model, place.origin + p * place.unit) / place.unit, plainValue(here->model, p),
                  3e-3)
          << "origin " << place.origin.x << " unit " << place.unit;
    }
  }
}

TEST(Fit, CountsSamplesAtOnePlaceAsOneWithTheirMean) {
  for (const double apart : {0.0, 1e-9}) {
    Samples s = sphere(100, {0, 0, 0}, 12);
    const std::size_t before = s.positions.size();
    for (std::size_t i = 0; i < before; i += 3) {
      s.positions.push_back(s.positions[i] + Vec3{apart, 0, 0});
      s.distances_mm.push_back(s.distances_mm[i] + 0.5);
    }
    const auto fitted = fit(s, {.tolerance_mm = 1e-6});
    ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
    EXPECT_EQ(fitted->report.centres, before);
    EXPECT_EQ(fitted->report.merged, 100U);
    EXPECT_NEAR(plainValue(fitted->model, s.positions[0]), 0.25, 1e-5);
    // What contradicts itself cannot be met, and the report says so.
    EXPECT_NEAR(fitted->report.residual_max_mm, 0.25, 1e-5);
  }
}

TEST(Fit, MeetsSamplesThatAreCloseButNotEqual) {
  Samples s = sphere(900, {0, 0, 0}, 13);
  const std::size_t before = s.positions.size();
  for (std::size_t i = 0; i < before; i += 10) {
    s.positions.push_back(s.positions[i] + Vec3{0.002, 0, 0});
    s.distances_mm.push_back(s.distances_mm[i] + 0.001);
  }
  const auto fitted = fit(s, {.tolerance_mm = 1e-4});
  ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
  EXPECT_EQ(fitted->report.merged, 0U);
  EXPECT_LT(plainResiduals(fitted->model, s).largest, 1.1e-4);
}

TEST(Fit, SaysHowFarItCameWhenTheToleranceIsBelowWhatDoubleCanGive) {
  for (const std::size_t count : {100UL, 900UL}) {
    const auto fitted = fit(sphere(count, {0, 0, 0}, 14), {.tolerance_mm = 1e-17});
    ASSERT_FALSE(fitted.has_value());
    EXPECT_EQ(fitted.error().code, ErrorCode::NotConverged);
    EXPECT_NE(fitted.error().message.find("e-"), std::string::npos) << fitted.error().message;
  }
}

TEST(Fit, HasTheSameBitsFromAnyNumberOfThreads) {
  const Samples s = sphere(900, {0, 0, 0}, 15, 0.1);
  const FitOptions one{.smoothing = kAutoSmoothing, .reduce_mm = 0.1, .threads = 1};
  FitOptions three = one;
  three.threads = 3;
  const auto a = fit(s, one), b = fit(s, three);
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_EQ(a->model.weights, b->model.weights);
  EXPECT_EQ(a->model.constant, b->model.constant);
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
  for (const double bad : {-0.5, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(fit(good, {.tolerance_mm = bad}).error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(fit(good, {.smoothing = bad}).error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(fit(good, {.reduce_mm = bad}).error().code, ErrorCode::InvalidArgument);
  }
  EXPECT_EQ(fit(good, {.tolerance_mm = 0}).error().code, ErrorCode::InvalidArgument);
}

TEST(Fit, TakesFourSamplesAndFlatPatchesWithinASolidSet) {
  EXPECT_TRUE(fit({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 1, 2, 3}}, {}).has_value());
  // A box: whole subdomains lie in one plane, where a linear polynomial cannot be told apart from its extension.
  Samples box;
  for (int i = 0; i < 30; ++i)
    for (int j = 0; j < 30; ++j)
      for (const double z : {0.0, 500.0, 501.0})
        box.positions.push_back({1.0 * i, 1.0 * j, z}), box.distances_mm.push_back(z > 0 ? 1 : 0);
  for (int i = 0; i < 300; ++i) box.positions.push_back({0.1 * i, 0.05 * i, 250}), box.distances_mm.push_back(0.5);
  const auto fitted = fit(box, {.tolerance_mm = 1e-3});
  ASSERT_TRUE(fitted.has_value()) << fitted.error().message;
  EXPECT_LT(plainResiduals(fitted->model, box).largest, 1.1e-3);
}

TEST(Fit, ReportsProgressThatNeverGoesBack) {
  double last = 0;
  const auto fitted =
      fit(sphere(900, {0, 0, 0}, 14, 0.1), {.smoothing = kAutoSmoothing, .reduce_mm = 0.1}, [&last](double now) {
        EXPECT_GE(now, last);
        last = now;
      });
  ASSERT_TRUE(fitted.has_value());
  EXPECT_EQ(last, 1.0);
}

}  // namespace
}  // namespace spinaltap::rbf
