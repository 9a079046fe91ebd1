#include "server/jobs/recording_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "core/session/scenes.h"
#include "server/jobs/drill_job.h"
#include "tests/server/small_case.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::jobs {
namespace {

/// Drills `cycles` of the scene `on` into a recording file; `each` is called after every cycle.
RecordingFile drillInto(store::Store& store, const test::SmallCase& small, std::uint64_t cycles,
                        const std::function<void(std::uint64_t)>& each = {}) {
  DrillSite site = siteOfPath(store, small.case_id, small.path_id).value();
  const recording::Header header{"test", small.case_id, small.path_id, "", site.config};
  RecordingFile file = RecordingFile::begin(store, header, site.volume).value();
  session::Session session = session::Session::create(std::move(site.volume), site.config).value();
  for (std::uint64_t i = 0; i < cycles; ++i) {
    const session::Input input = session::sceneInput(session::Scene::On, i, -1);
    std::vector<std::uint32_t> removed;
    const session::Output output = session.step(
        input, [&](std::span<const std::uint32_t> some) { removed.insert(removed.end(), some.begin(), some.end()); });
    EXPECT_TRUE(file.append(input, output, removed, session.volume()).has_value());
    if (each) each(i);
  }
  return file;
}

TEST(RecordingFile, IsKeptWithItsCaseAndReplays) {
  const test::TemporaryFolder folder;
  auto store = store::Store::open(folder.path()).value();
  const auto small = test::makeSmallCase(store);
  RecordingFile file = drillInto(store, small, 300);
  const auto row = file.keep(true, "{}").value();
  EXPECT_EQ(row.id, file.id());
  EXPECT_EQ(row.cycles, 300u);
  const auto read = recording::read(store.blobs().get(row.bytes).value()).value();
  EXPECT_TRUE(read.complete);
  EXPECT_TRUE(recording::replay(read).value().verified);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "live"));
}

TEST(RecordingFile, CutOffSaysSoAndStillReplays) {
  const test::TemporaryFolder folder;
  auto store = store::Store::open(folder.path()).value();
  const auto small = test::makeSmallCase(store);
  const auto row = drillInto(store, small, 300).keep(false, "{}").value();
  const auto read = recording::read(store.blobs().get(row.bytes).value()).value();
  EXPECT_FALSE(read.complete);
  EXPECT_EQ(read.inputs.size(), 300u);
  EXPECT_TRUE(recording::replay(read).value().verified);
}

TEST(RecordingFile, AProgramKilledWhileDrillingLosesAtMostTheLastSecond) {
  const test::TemporaryFolder folder;
  test::SmallCase small;
  {
    auto store = store::Store::open(folder.path()).value();
    small = test::makeSmallCase(store);
  }
  const pid_t child = ::fork();
  if (child == 0) {
    auto store = store::Store::open(folder.path()).value();
    const auto file = drillInto(store, small, 5000, [](std::uint64_t cycle) {
      if (cycle == 2500) ::usleep(1'100'000);  // a second passes: the next append puts all before it on disk
      if (cycle == 2600) ::raise(SIGKILL);
    });
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));

  auto store = store::Store::open(folder.path()).value();
  EXPECT_EQ(recoverRecordings(store), 1);
  const auto rows = store.recordings(small.case_id).value();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_FALSE(rows[0].complete);
  EXPECT_GE(rows[0].cycles, 2500u);
  EXPECT_TRUE(recording::replay(recording::read(store.blobs().get(rows[0].bytes).value()).value()).value().verified);
  EXPECT_EQ(recoverRecordings(store), 0);
}

TEST(RecordingFile, IsLeftAloneWhileItsWriterLives) {
  const test::TemporaryFolder folder;
  auto store = store::Store::open(folder.path()).value();
  const auto small = test::makeSmallCase(store);
  RecordingFile file = drillInto(store, small, 10);
  EXPECT_EQ(recoverRecordings(store), 0);
  EXPECT_TRUE(file.keep(true, "{}").has_value());
}

TEST(RecordingFile, RubbishInTheFolderIsClearedAway) {
  const test::TemporaryFolder folder;
  auto store = store::Store::open(folder.path()).value();
  std::ofstream(folder.path() / "live" / "rzzzzzzz.rec") << "not a recording";
  std::ofstream(folder.path() / "live" / "ryyyyyyy.rec").flush();
  EXPECT_EQ(recoverRecordings(store), 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "live"));
}

}  // namespace
}  // namespace spinaltap::jobs
