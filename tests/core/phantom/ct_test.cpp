#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/hash.h"
#include "core/phantom/ct.h"

namespace spinaltap::phantom {
namespace {

constexpr std::uint64_t kGoldenHash1 = 10260478036511288180ULL, kGoldenHash1Osteoporotic = 9922078761963903463ULL;

std::uint64_t hashOf(const volume::CtVolume& ct) {
  std::uint64_t hash = 0;
  for (const std::int16_t hu : ct.hu) hash = combine(hash, static_cast<std::uint64_t>(static_cast<std::uint16_t>(hu)));
  return hash;
}

volume::CtVolume coarse(std::uint64_t seed, bool osteoporotic = false, double noise_hu = 20) {
  CtOptions options = CtOptions::coarser(4);
  options.noise_hu = noise_hu;
  return sampleCt(Phantom::make({seed, osteoporotic}), options).value();
}

/// Some slices of the real stack, around the pedicles, without noise.
CtOptions fineSlab() {
  CtOptions options;
  options.dims = {300, 300, 9};
  options.noise_hu = 0;
  return options;
}

TEST(PhantomCt, HasOneHashOnEveryTarget) {
  // A change here changes every stored phantom: say so in the commit that does it.
  EXPECT_EQ(hashOf(coarse(1)), kGoldenHash1);
  EXPECT_EQ(hashOf(coarse(1, true)), kGoldenHash1Osteoporotic);
  EXPECT_NE(hashOf(coarse(2)), hashOf(coarse(1)));
}

TEST(PhantomCt, AnotherNoiseSeedChangesTheNoiseOnly) {
  const auto phantom = Phantom::make({1, false});
  CtOptions options = CtOptions::coarser(4);
  const auto one = sampleCt(phantom, options).value();
  options.seed = 2;
  const auto two = sampleCt(phantom, options).value();
  const auto clean = coarse(1, false, 0);
  EXPECT_NE(hashOf(one), hashOf(two));
  for (const auto* noisy : {&one, &two}) {
    double sum = 0, squares = 0;
    int count = 0;
    for (std::size_t n = 0; n < clean.hu.size(); ++n) {
      if (clean.hu[n] < -900) continue;  // the clamp at -1024 cuts the noise of air
      const double d = noisy->hu[n] - clean.hu[n];
      sum += d, squares += d * d, ++count;
    }
    // 300,000 voxels; neighbours correlate over about 7: the mean within 20 / sqrt(43,000) * 5, the deviation alike.
    EXPECT_NEAR(sum / count, 0, 0.5);
    EXPECT_NEAR(std::sqrt(squares / count), 20, 0.5);
  }
}

/// The slow twin of one voxel: trueHu averaged over the slice's box and a Gaussian of the stated width.
double integrated(const Phantom& phantom, const CtOptions& options, const Vec3& centre) {
  const double sigma = options.psf_fwhm_mm / 2.354820045;
  double sum = 0, weights = 0;
  for (int a = -6; a <= 6; ++a) {
    for (int b = -6; b <= 6; ++b) {
      const double x = a * sigma / 2, y = b * sigma / 2;
      const double w = std::exp(-0.5 * (x * x + y * y) / (sigma * sigma));
      for (int c = 0; c < 22; ++c) {
        const double z = ((c + 0.5) / 22 - 0.5) * options.thickness_mm;
        sum += w * phantom.trueHu(centre + Vec3{x, y, z});
        weights += w;
      }
    }
  }
  return sum / weights;
}

TEST(PhantomCt, AVoxelIsTheMeanOverItsSliceAndPointSpread) {
  const auto phantom = Phantom::make({1, false});
  const CtOptions options = fineSlab();
  const auto ct = sampleCt(phantom, options).value();
  double squares = 0, bias = 0;
  int count = 0;
  for (int j = 110; j < 190 && count < 150; j += 5) {
    for (int i = 60; i < 240 && count < 150; i += 8) {
      const Vec3 centre = ct.grid.toPatient({static_cast<double>(i), static_cast<double>(j), 4.0});
      if (std::fabs(phantom.signedDistance(centre)) > 2.0) continue;
      const double d = ct.hu[ct.grid.index(i, j, 4)] - integrated(phantom, options, centre);
      squares += d * d, bias += d, ++count;
    }
  }
  ASSERT_GT(count, 100);
  // Four samples a pixel, five layers a slice and a kernel of five taps, across edges of about 1000 HU: some 2 %.
  EXPECT_LT(std::sqrt(squares / count), 35);
  EXPECT_LT(std::fabs(bias / count), 8);
}

TEST(PhantomCt, ThickSlicesBlurEndplates) {
  const auto phantom = Phantom::make({1, false});
  CtOptions options;
  options.dims = {40, 40, 95};
  options.noise_hu = 0;
  const auto peak = [&](double thickness_mm) {
    options.thickness_mm = thickness_mm;
    const auto ct = sampleCt(phantom, options).value();
    // The stack's middle is behind the body, so look along z through the lamina.
    int most = -1024;
    for (const std::int16_t hu : ct.hu) most = std::max<int>(most, hu);
    return most;
  };
  EXPECT_GT(peak(0.3), peak(3.0));
}

TEST(PhantomCt, TheWholeBoneIsInTheStackForEverySeed) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const auto phantom = Phantom::make({seed, false});
    const volume::Grid grid = ctGrid(phantom);
    for (int i = 60; i < 452; i += 3) {
      for (int j = 20; j < 400; j += 3) {
        for (const int k : {0, grid.dims[2] - 1}) {
          // Sampled every millimetre: what passes between would be thinner than that. Half a slice to spare.
          const Vec3 p = grid.toPatient({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
          ASSERT_GT(phantom.signedDistance(p), 0.3) << "seed " << seed << " slice " << k;
        }
      }
    }
    const Vec3 low = grid.toVoxel(phantom.bounds().low_patient), high = grid.toVoxel(phantom.bounds().high_patient);
    EXPECT_GT(low.x, 10);
    EXPECT_GT(low.y, 10);
    EXPECT_LT(high.x, 501);
    EXPECT_LT(high.y, 501);
  }
}

TEST(PhantomCt, TheTruthLabelIsTheSignAtEveryVoxel) {
  const auto phantom = Phantom::make({9, false});
  const volume::Grid grid = ctGrid(phantom, CtOptions::coarser(5));
  const auto label = truthLabel(phantom, grid);
  std::size_t inside = 0;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0]; ++i) {
        const Vec3 p = grid.toPatient({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
        ASSERT_EQ(label.inside[grid.index(i, j, k)] != 0, phantom.signedDistance(p) < 0);
        inside += label.inside[grid.index(i, j, k)];
      }
    }
  }
  EXPECT_GT(inside, 1000u);
}

TEST(PhantomCt, ProgressRisesToOne) {
  double last = 0;
  CtOptions options = CtOptions::coarser(16);
  (void)sampleCt(Phantom::make({1, false}), options, [&](double part) {
    EXPECT_GT(part, last);
    last = part;
  });
  EXPECT_EQ(last, 1.0);
}

TEST(PhantomCt, RefusesOptionsThatNoScannerHas) {
  const auto phantom = Phantom::make({1, false});
  const auto refused = [&](auto change) {
    CtOptions options = CtOptions::coarser(16);
    change(options);
    const auto ct = sampleCt(phantom, options);
    return !ct && ct.error().code == ErrorCode::InvalidArgument && !ct.error().message.empty();
  };
  EXPECT_TRUE(refused([](CtOptions& o) { o.dims[1] = 0; }));
  EXPECT_TRUE(refused([](CtOptions& o) { o.pixel_mm = 0; }));
  EXPECT_TRUE(refused([](CtOptions& o) { o.spacing_mm = -1; }));
  EXPECT_TRUE(refused([](CtOptions& o) { o.thickness_mm = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](CtOptions& o) { o.noise_hu = -1; }));
  EXPECT_TRUE(refused([](CtOptions& o) { o.psf_fwhm_mm = std::numeric_limits<double>::infinity(); }));
}

}  // namespace
}  // namespace spinaltap::phantom
