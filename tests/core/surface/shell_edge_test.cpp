#include "core/surface/shell_edge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/random.h"

namespace spinaltap::surface {
namespace {

struct Shell {
  double edge_mm = 0.13, thickness_mm = 0.6, blur_mm = 0.38;
  double outside_hu = 50, cortical_hu = 900, inside_hu = 180;

  [[nodiscard]] double hu(double mm) const {
    const auto below = [&](double edge) { return 0.5 * std::erfc((mm - edge) / (blur_mm * std::sqrt(2.0))); };
    return outside_hu + (cortical_hu - outside_hu) * below(edge_mm) +
           (inside_hu - cortical_hu) * below(edge_mm - thickness_mm);
  }
};

struct Sampled {
  std::vector<double> hu;
  EdgeQuery query;
  [[nodiscard]] Profile profile() const { return {hu, -6, 0.1}; }
};

Sampled sampled(const Shell& shell, double noise_hu = 0, std::uint64_t seed = 1) {
  Sampled out;
  Random random(seed);
  for (int n = 0; n <= 120; ++n) out.hu.push_back(shell.hu(-6 + 0.1 * n) + noise_hu * random.gaussian());
  out.query.blur_mm = shell.blur_mm;
  out.query.cortical_hu = shell.cortical_hu;
  out.query.least_fall_hu = 100;
  return out;
}

TEST(ShellEdge, FindsAnEdgeThatHalfWayToThePeakPutsOutside) {
  for (const double thickness : {0.3, 0.5, 0.8, 1.2, 2.5}) {
    Shell shell;
    shell.thickness_mm = thickness;
    const Sampled s = sampled(shell);
    const auto edge = findShellEdge(s.profile(), s.query);
    ASSERT_TRUE(edge.has_value());
    // The model made the profile: only the priors of marrow and thickness pull, by far less than the step.
    EXPECT_NEAR(edge->edge_mm, shell.edge_mm, 0.01) << thickness;
    EXPECT_NEAR(edge->thickness_mm, thickness, 0.05) << thickness;
    if (thickness < 0.6) {
      EXPECT_GT(edge->half_mm, shell.edge_mm + 0.1) << "a thin cortex swells";
    }
  }
}

TEST(ShellEdge, IsAsPreciseAsTheNoiseLets) {
  const Shell shell;
  double squares = 0;
  constexpr int kCases = 200;
  for (int n = 0; n < kCases; ++n) {
    const Sampled s = sampled(shell, 20, 100 + static_cast<std::uint64_t>(n));
    const auto edge = findShellEdge(s.profile(), s.query);
    ASSERT_TRUE(edge.has_value()) << "seed " << 100 + n;
    squares += std::pow(edge->edge_mm - shell.edge_mm, 2);
  }
  // One HU beside the edge places it to noise / slope: 20 / (850 / (0.38 sqrt(2 pi))) = 0.022 mm; several share the
  // work with four more unknowns.
  EXPECT_LT(std::sqrt(squares / kCases), 0.03);
}

TEST(ShellEdge, ADensityThatIsOffMovesTheEdgeByLessThanHalfTheThicknessItCosts) {
  Shell shell;
  shell.thickness_mm = 0.5;
  Sampled s = sampled(shell);
  s.query.cortical_hu = 1.25 * shell.cortical_hu;
  const auto edge = findShellEdge(s.profile(), s.query);
  ASSERT_TRUE(edge.has_value());
  // Blurred beyond recognition, thickness times density is what stays: a fifth less of 0.5 mm, half of it at each side.
  EXPECT_NEAR(edge->edge_mm, shell.edge_mm, 0.5 * 0.2 * 0.5 + 0.01);
}

TEST(ShellEdge, ReadsTheBlurWhenItIsAskedTo) {
  Shell shell;
  shell.thickness_mm = 1.6;
  for (const double blur : {0.25, 0.4, 0.5}) {
    shell.blur_mm = blur;
    Sampled s = sampled(shell);
    s.query.blur_mm = 0.35;
    s.query.free_blur = true;
    const auto edge = findShellEdge(s.profile(), s.query);
    ASSERT_TRUE(edge.has_value());
    EXPECT_NEAR(edge->blur_mm, blur, 0.02);
  }
}

TEST(ShellEdge, StopsAtTheNextBoneAndAtTheFarWall) {
  Shell shell;
  Sampled s = sampled(shell);
  Shell facet = shell;  // another bone 1.6 mm outside, facing this one; and this one's far wall 3 mm inside
  for (int n = 0; n <= 120; ++n) {
    const double mm = -6 + 0.1 * n;
    s.hu[static_cast<std::size_t>(n)] += facet.hu(1.6 + 2 * shell.edge_mm - mm) - shell.outside_hu;
    if (mm < -2) s.hu[static_cast<std::size_t>(n)] += 500 * std::exp(-std::pow((mm + 3) / 0.4, 2));
  }
  const auto edge = findShellEdge(s.profile(), s.query);
  ASSERT_TRUE(edge.has_value());
  EXPECT_NEAR(edge->edge_mm, shell.edge_mm, 0.1);
}

TEST(ShellEdge, ASolidBlockNeedsNoShell) {
  Shell block;
  block.inside_hu = block.cortical_hu = 400;
  Sampled s = sampled(block);
  s.query.cortical_hu = 900;  // expected, but not there
  const auto edge = findShellEdge(s.profile(), s.query);
  ASSERT_TRUE(edge.has_value());
  EXPECT_NEAR(edge->edge_mm, block.edge_mm, 0.05);
}

TEST(ShellEdge, NoFallNoEdge) {
  Shell flat;
  flat.cortical_hu = flat.inside_hu = 120;  // 70 HU above what surrounds it
  const Sampled s = sampled(flat);
  EXPECT_FALSE(findShellEdge(s.profile(), s.query).has_value());
  const Sampled none{std::vector<double>(121, 40.0), s.query};
  EXPECT_FALSE(findShellEdge(none.profile(), none.query).has_value());
  Shell away;
  away.edge_mm = 3;  // beyond the reach
  const Sampled far = sampled(away);
  EXPECT_FALSE(findShellEdge(far.profile(), far.query).has_value());
}

}  // namespace
}  // namespace spinaltap::surface
