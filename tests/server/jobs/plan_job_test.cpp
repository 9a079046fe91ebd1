// The points that a path keeps, beside every one of them worked out alone.
#include "server/jobs/plan_job.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/volume/sample.h"
#include "server/jobs/case_files.h"
#include "server/jobs/reconstruct_job.h"
#include "tests/server/phantom_case.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::jobs {
namespace {

/// Of fast sums, as plan_job.cpp asks for them: only points nearer to the surface may lie on its other side.
constexpr double kFieldTolerance_mm = 1e-4;

std::vector<Vec3> placesOf(const store::Path& path) {
  const Frame frame = plan::pathFrame(path.path);
  const auto table = point_volume::discTable(path.lattice);
  std::vector<Vec3> out;
  for (int disc = 0; disc < path.lattice.discs; ++disc)
    for (std::size_t n = 0; n < table.x_mm.size(); ++n)
      out.push_back(frame.toPatient({table.x_mm[n], table.y_mm[n], path.lattice.discZ_mm(disc)}));
  return out;
}

TEST(PlanPath, KeepsThePointsInsideTheModelWithTheirDensitiesButForThoseOnItsVerySurface) {
  const test::TemporaryFolder folder;
  auto store = store::Store::open(folder.path()).value();
  ReconstructJob reconstruct;
  reconstruct.case_id = test::phantomCase(store);
  reconstruct.sample_spacing_mm = 2, reconstruct.cell_mm = 3;
  ASSERT_TRUE(reconstructCase(store, reconstruct, {}).has_value());
  const auto pedicle = phantom::Phantom::make({}).pedicle(phantom::Side::Left);
  PlanJob job{reconstruct.case_id, "left", {}};
  job.path.entry_patient = pedicle.entry_patient, job.path.target_patient = pedicle.target_patient;
  // Wider than the pedicle, so that surface lies along all of it.
  job.path.volume_radius_mm = 8, job.path.lead_mm = kLead_mm, job.path.spacing_mm = 0.4;
  const auto path = planPath(store, job, {});
  ASSERT_TRUE(path.has_value()) << path.error().message;

  const auto row = store.findCase(reconstruct.case_id).value();
  const auto model = loadModel(store, row).value();
  const auto roi = loadRoi(store, row).value();
  const auto points = loadPointVolume(store, *path).value();
  const std::vector<Vec3> places = placesOf(*path);
  ASSERT_EQ(points.density_mg_cm3.size(), places.size());
  ASSERT_GT(places.size() * model.centres.size(), 100'000'000U) << "fast sums have nothing to do here";
  std::vector<double> s(places.size());
  rbf::evaluate(model, places, s);
  std::size_t alive = 0, sides = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool is_alive = points.isAlive(static_cast<std::uint32_t>(i));
    alive += is_alive ? 1 : 0;
    if (is_alive != (s[i] < 0)) {
      ++sides;
      ASSERT_LE(std::abs(s[i]), kFieldTolerance_mm) << "point " << i;
    }
    const std::uint16_t density =
        is_alive ? point_volume::densityFromHu(volume::sampleHu(roi, places[i])) : std::uint16_t{0};
    ASSERT_EQ(points.density_mg_cm3[i], density) << "point " << i;
  }
  std::printf("  %zu points, %zu alive, %zu on the other side; %zu centres\n", places.size(), alive, sides,
              model.centres.size());
  EXPECT_EQ(alive, path->points_alive);
  EXPECT_GT(alive, places.size() / 4);
  EXPECT_LT(alive, places.size() * 9 / 10);
}

}  // namespace
}  // namespace spinaltap::jobs
