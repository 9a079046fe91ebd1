// What a case's owner sees while it is worked on: the stages in their order, each from its beginning on, never
// backwards.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "server/jobs/reconstruct_job.h"
#include "tests/server/phantom_case.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::jobs {
namespace {

struct Told {
  std::vector<std::string> stages;  ///< in the order of their first words
  std::map<std::string, std::vector<double>> parts;

  [[nodiscard]] Progress listener() {
    return [this](std::string_view stage, double part) {
      if (stages.empty() || stages.back() != stage) stages.emplace_back(stage);
      parts[std::string(stage)].push_back(part);
    };
  }
};

TEST(ReconstructProgress, TellsEveryStageInOrderAndNeverGoesBack) {
  const test::TemporaryFolder folder;
  auto store = store::Store::open(folder.path());
  ASSERT_TRUE(store.has_value());
  ReconstructJob job;
  job.case_id = test::phantomCase(*store);
  job.sample_spacing_mm = 2, job.cell_mm = 1.5;
  Told told;
  const auto figures = reconstructCase(*store, job, told.listener());
  ASSERT_TRUE(figures.has_value()) << figures.error().message;
  EXPECT_EQ(told.stages, (std::vector<std::string>{"load", "boundary", "fit", "mesh", "keep"}));
  for (const auto& [stage, parts] : told.parts) {
    EXPECT_LT(parts.front(), 0.5) << stage << " is told when it begins";
    for (std::size_t n = 0; n < parts.size(); ++n) {
      EXPECT_GE(parts[n], n == 0 ? 0 : parts[n - 1]) << stage;
      EXPECT_LE(parts[n], 1) << stage;
    }
  }
  // The long ones are told while they run, not only at their ends.
  for (const char* stage : {"boundary", "fit", "mesh"}) EXPECT_GE(told.parts[stage].size(), 4U) << stage;
  double stages_s = 0;
  for (const char* key : {"load_s", "boundary_s", "fit_s", "mesh_s", "keep_s"}) stages_s += figures->value(key, -1.0);
  EXPECT_LE(stages_s, figures->value("total_s", 0.0) * (1 + 1e-9));
}

TEST(ReconstructProgress, AMethodIsKeptWithTheSurface) {
  const test::TemporaryFolder folder;
  auto store = store::Store::open(folder.path());
  ASSERT_TRUE(store.has_value());
  ReconstructJob job;
  job.case_id = test::phantomCase(*store);
  job.method = surface::Method::Normal;
  job.cell_mm = 2;
  const auto figures = reconstructCase(*store, job, {});
  ASSERT_TRUE(figures.has_value()) << figures.error().message;
  const auto row = store->findCase(job.case_id);
  ASSERT_TRUE(row.has_value());
  EXPECT_EQ(Figures::parse(row->figures_json)["method"], "normal");
}

}  // namespace
}  // namespace spinaltap::jobs
