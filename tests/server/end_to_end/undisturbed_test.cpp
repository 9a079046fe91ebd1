// Live drills while the same data folder takes in and reconstructs another case. By counts: no test asserts a time (the
// times are tests/bench/bench_live.py's).
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "server/load/load.h"
#include "tests/server/program.h"
#include "tests/server/small_case.h"
#include "tests/server/sockets.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::test {
namespace {

TEST(Undisturbed, EveryPoseIsAnsweredWhileACaseIsImportedAndReconstructed) {
  const TemporaryFolder folder;
  const std::string data = (folder.path() / "data").string(), ct = (folder.path() / "ct").string();
  auto store = store::Store::open(data).value();
  const SmallCase small = makeSmallCase(store);
  const Json phantom = run({"phantom", "--out", ct, "--reduce", "3", "--json"}).json();
  const Json seed = phantom["seed_point_patient"];
  const Server server(data);

  std::atomic<int> jobs_done = 0;
  std::atomic<bool> drilled = false;
  std::thread jobs([&] {
    do {
      const auto imported = run({"import", "--from", ct, "--name", "meanwhile", "--data", data, "--json"});
      ASSERT_EQ(imported.code, 0) << imported.err;
      const std::string id = imported.json()["case_id"];
      const std::string point = seed[0].dump() + "," + seed[1].dump() + "," + seed[2].dump();
      EXPECT_EQ(run({"segment", id, "--seed", point, "--data", data, "--json"}).code, 0);
      EXPECT_EQ(run({"reconstruct", id, "--data", data, "--json"}).code, 0);
      ++jobs_done;
    } while (!drilled);
  });
  load::LoadJob job;
  job.sessions = 4, job.rate_hz = 100, job.seconds = 3;
  load::Target target;
  target.server.port = static_cast<std::uint16_t>(server.port());
  target.case_id = small.case_id, target.path_id = small.path_id;
  job.target = target;
  const auto figures = load::run(job, {});
  drilled = true;
  jobs.join();
  ASSERT_TRUE(figures.has_value()) << figures.error().message;
  EXPECT_GE(jobs_done, 1) << "or nothing was there to disturb";
  EXPECT_GT((*figures)["sent"], 0);
  EXPECT_EQ((*figures)["unanswered"], 0) << "no feedback had to give way to a newer one";
  // a period is 10 ms; a job that could hold up a loop would do so for whole seconds of the three
  EXPECT_LT((*figures)["late"].get<int>(), (*figures)["sent"].get<int>() / 10);
  const Reply metrics = get(server.port(), "/metrics");
  EXPECT_NE(metrics.body.find("\nspinaltap_lost_samples_total 0\n"), std::string::npos);
  EXPECT_NE(metrics.body.find("\nspinaltap_cycles_total " + (*figures)["sent"].dump() + "\n"), std::string::npos);
}

}  // namespace
}  // namespace spinaltap::test
