#include "server/jobs/fit_job.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/base/random.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::jobs {
namespace {

/// Points on a sphere of radius 20 and their normals.
std::string sphereWithNormals(int count) {
  Random random(1);
  std::ostringstream out;
  out.precision(17);
  out << "x y z nx ny nz\n# a sphere\n";
  for (int i = 0; i < count; ++i) {
    const Vec3 d = normalized({random.gaussian(), random.gaussian(), random.gaussian()});
    out << 20 * d.x << ' ' << 20 * d.y << ',' << 20 * d.z << "\t" << 3 * d.x << ' ' << 3 * d.y << ' ' << 3 * d.z
        << '\n';
  }
  return out.str();
}

std::string textOf(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ParseSamples, TakesValuesOrNormalsInAnySpreadsheetsHand) {
  const auto values = parseSamples("1, 2 ,3;4\n\n# no more\n5 6 7 +8e-1\n", "f", {});
  ASSERT_TRUE(values.has_value()) << values.error().message;
  EXPECT_EQ(values->positions[1], (Vec3{5, 6, 7}));
  EXPECT_EQ(values->distances_mm[1], 0.8);
  const auto normals = parseSamples(sphereWithNormals(200), "f", 1.0);
  ASSERT_TRUE(normals.has_value()) << normals.error().message;
  EXPECT_GT(normals->positions.size(), 500U);  // most have a sample on either side
  for (std::size_t i = 0; i < normals->positions.size(); ++i)
    EXPECT_NEAR(norm(normals->positions[i]) - 20, normals->distances_mm[i], 1e-12);
}

TEST(ParseSamples, SaysWhichLineIsWrongAndHow) {
  const auto message = [](std::string_view text) { return parseSamples(text, "p.xyz", {}).error().message; };
  EXPECT_EQ(message("1 2 3 4\n1 2 x 4\n"), "p.xyz line 2: not a number: 'x'");
  EXPECT_EQ(message("1 2 3 4\n1 2 3\n"),
            "p.xyz line 2: 3 numbers; each line needs 4 (x y z value) or 6 (x y z and a normal), all the same");
  EXPECT_EQ(message("1 2 3 4 5\n"),
            "p.xyz line 1: 5 numbers; each line needs 4 (x y z value) or 6 (x y z and a normal), all the same");
  EXPECT_EQ(message("nan 2 3 4\n"), "p.xyz line 1: number 1 is not finite");
  EXPECT_EQ(message("1 2 3 1e999\n"), "p.xyz line 1: not a number: '1e999'");
  EXPECT_EQ(message("# nothing\n"), "p.xyz: no points");
  EXPECT_EQ(message("1 2 3 0 0 0\n"), "p.xyz: a normal has no length");
}

TEST(FitJob, WritesTheValuesOfTheFitItReports) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "bone.xyz") << sphereWithNormals(800);
  std::ofstream(folder.path() / "at.xyz") << "0 0 0\n25 0 0\n0 0 20\n1e9 0 0\n";
  FitJob job;
  job.samples = folder.path() / "bone.xyz", job.points = folder.path() / "at.xyz";
  job.gradients = true;
  const auto figures = fitPoints(job, {});
  ASSERT_TRUE(figures.has_value()) << figures.error().message;
  EXPECT_EQ(figures->value("points", 0), 4);
  EXPECT_LT(figures->value("residual_max_mm", 1.0), 0.01);
  EXPECT_GT(figures->value("peak_rss_mb", 0.0), 1);
  std::istringstream out(textOf(folder.path() / "at.xyz.values"));
  double value[4], slope[4][3];
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(out >> value[i] >> slope[i][0] >> slope[i][1] >> slope[i][2]);
  EXPECT_LT(value[0], -5);
  EXPECT_GT(value[1], 2);
  // 800 points on 5,000 mm2 are 2.5 mm apart, and a flat triangle of that size lies 0.04 mm inside; the slope is 1.
  EXPECT_NEAR(value[2], 0, 0.1);
  EXPECT_NEAR(slope[2][2], 1, 0.2);
  EXPECT_GT(value[3], 0) << "far away is outside";
}

TEST(FitJob, LeavesNothingBehindWhenSomethingIsWrong) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "bone.xyz") << sphereWithNormals(100);
  std::ofstream(folder.path() / "at.xyz") << "0 0 0\n25 0\n";
  FitJob job;
  job.samples = folder.path() / "bone.xyz", job.points = folder.path() / "at.xyz";
  EXPECT_EQ(fitPoints(job, {}).error().message, "at.xyz line 2: 2 numbers; each line needs 3: x y z");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "at.xyz.values"));
  job.samples = folder.path() / "none.xyz";
  EXPECT_EQ(fitPoints(job, {}).error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace spinaltap::jobs
