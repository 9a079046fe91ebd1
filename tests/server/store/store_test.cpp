#include "server/store/store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <limits>
#include <set>
#include <thread>

#include "server/store/ids.h"
#include "server/store/schema.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::store {
namespace {

Case exampleCase() {
  Case wanted;
  wanted.label = "Phantom L3 \xc3\xa9'\"; DROP TABLE cases; --";
  wanted.grid.dims = {512, 511, 95};
  // numbers that a sloppy round trip through text would change
  wanted.grid.spacing_mm = {0.1 + 0.2, 1.0 / 3.0, 0.5};
  wanted.grid.origin_patient = {-1e6 / 7, std::numeric_limits<double>::denorm_min(), 1e300};
  wanted.grid.direction = {{0.6, 0.8, 0}, {-0.8, 0.6, 0}, {0, 0, 1}};
  wanted.ct = std::string(64, 'a');
  return wanted;
}

Path examplePath(const std::string& case_id) {
  Path wanted;
  wanted.case_id = case_id;
  wanted.label = "left pedicle";
  wanted.path.entry_patient = {-1.0 / 3.0, 2, 3};
  wanted.path.target_patient = {4, 5, 6.1};
  wanted.path.lead_mm = 2.5;
  wanted.lattice = {0.1, 40, 400, -25};
  wanted.points_alive = 1'234'567;
  wanted.point_volume = std::string(64, 'b');
  return wanted;
}

TEST(Store, GivesBackACaseExactlyAsItWasKept) {
  const test::TemporaryFolder folder;
  std::string id;
  {
    auto store = Store::open(folder.path()).value();
    id = store.addCase(exampleCase()).value().id;
  }
  auto store = Store::open(folder.path()).value();  // a second start
  const Case found = store.findCase(id).value();
  EXPECT_EQ(found.label, exampleCase().label);
  EXPECT_EQ(found.grid, exampleCase().grid);
  EXPECT_EQ(found.ct, exampleCase().ct);
  EXPECT_EQ(found.stage, Stage::Imported);
  EXPECT_EQ(found.created.size(), 20u);
  EXPECT_TRUE(isId(id));
}

TEST(Store, GivesBackAPathAndARecordingExactlyAsTheyWereKept) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const Case in = store.addCase(exampleCase()).value();
  const Path path = store.addPath(examplePath(in.id)).value();
  const Path found = store.findPath(in.id, path.id).value();
  EXPECT_EQ(found.path.entry_patient, path.path.entry_patient);
  EXPECT_EQ(found.path.target_patient, path.path.target_patient);
  EXPECT_EQ(found.path.bit, path.path.bit);
  EXPECT_EQ(found.path.lead_mm, 2.5);
  EXPECT_EQ(found.lattice, path.lattice);
  EXPECT_EQ(found.points_alive, 1'234'567u);
  Recording wanted{"", in.id, path.id, "", (1ull << 40) + 1, true, "{\"a\":1}", std::string(64, 'c')};
  const Recording kept = store.addRecording(wanted).value();
  const Recording back = store.findRecording(kept.id).value();
  EXPECT_EQ(back.cycles, wanted.cycles);
  EXPECT_TRUE(back.complete);
  EXPECT_EQ(back.metrics_json, wanted.metrics_json);
  EXPECT_EQ(store.findCase(in.id).value().paths, 1);
  EXPECT_EQ(store.findCase(in.id).value().recordings, 1);
}

TEST(Store, MovesACaseThroughItsStages) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string id = store.addCase(exampleCase()).value().id;
  ASSERT_TRUE(store.setLabel(id, std::string(64, 'd'), "segmented").has_value());
  EXPECT_EQ(store.findCase(id).value().stage, Stage::Segmented);
  const Reconstruction made{std::string(64, '1'), std::string(64, '2'), std::string(64, '3'), "{\"fit_s\":1.5}"};
  ASSERT_TRUE(store.setReconstruction(id, made).has_value());
  const Case found = store.findCase(id).value();
  EXPECT_EQ(found.stage, Stage::Reconstructed);
  EXPECT_EQ(found.mesh, made.mesh);
  EXPECT_EQ(found.figures_json, made.figures_json);
}

TEST(Store, ListsNewestCasesFirst) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string first = store.addCase(exampleCase()).value().id, second = store.addCase(exampleCase()).value().id;
  const auto cases = store.cases().value();
  ASSERT_EQ(cases.size(), 2u);
  EXPECT_EQ(cases[0].id, second);
  EXPECT_EQ(cases[1].id, first);
}

TEST(Store, NamesWhatIsNotThere) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string id = store.addCase(exampleCase()).value().id;
  EXPECT_EQ(store.findCase("czzzzzzz").error().message, "there is no case czzzzzzz");
  EXPECT_EQ(store.findCase("x' OR '1'='1").error().message, "there is no case (not an id)");
  EXPECT_EQ(store.findPath(id, "pzzz").error().code, ErrorCode::NotFound);
  EXPECT_EQ(store.findRecording("").error().code, ErrorCode::NotFound);
  EXPECT_EQ(store.setLabel("czzz", "", "segmented").error().code, ErrorCode::NotFound);
  EXPECT_EQ(store.setReconstruction("czzz", {}).error().code, ErrorCode::NotFound);
  EXPECT_EQ(store.addPath(examplePath("czzz")).error().code, ErrorCode::NotFound);
  EXPECT_EQ(store.addRecording({"", id, "pzzz", "", 0, false, "{}", ""}).error().code, ErrorCode::NotFound);
}

TEST(Store, DoesNotServeAPathUnderAnotherCase) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string a = store.addCase(exampleCase()).value().id, b = store.addCase(exampleCase()).value().id;
  const std::string path = store.addPath(examplePath(a)).value().id;
  EXPECT_EQ(store.findPath(b, path).error().code, ErrorCode::NotFound);
}

/// Points of bytes of their own, so that it can be seen whether they are still there.
Path pathWithPoints(Store& store, const std::string& case_id, char content) {
  Path wanted = examplePath(case_id);
  wanted.point_volume = store.blobs().put(std::vector<std::byte>(100, std::byte(content)), Gzip::Sibling).value();
  return wanted;
}

TEST(Store, APathThatNobodyDrilledKeepsItsIdWhenItIsReplacedAndItsOldPointsGo) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string id = store.addCase(exampleCase()).value().id;
  const Path old = store.addPath(pathWithPoints(store, id, 'o')).value();
  Path wanted = pathWithPoints(store, id, 'n');
  wanted.id = old.id, wanted.label = "moved", wanted.path.target_patient = {9, 9, 9};
  const Path replaced = store.replacePath(wanted).value();
  EXPECT_EQ(replaced.id, old.id);
  const auto listed = store.paths(id).value();
  ASSERT_EQ(listed.size(), 1u);
  EXPECT_EQ(listed[0].label, "moved");
  EXPECT_EQ(listed[0].path.target_patient, wanted.path.target_patient);
  EXPECT_EQ(store.blobs().file(old.point_volume).error().code, ErrorCode::NotFound);
  EXPECT_TRUE(store.blobs().gzipFile(old.point_volume).empty());
  EXPECT_TRUE(store.blobs().get(replaced.point_volume).has_value());
}

TEST(Store, ADrilledPathStaysAsItWasForItsRecordingsWhenItIsReplaced) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string id = store.addCase(exampleCase()).value().id;
  const Path old = store.addPath(pathWithPoints(store, id, 'o')).value();
  ASSERT_TRUE(store.findPathToDrill(id, old.id).value().drilled);
  Path wanted = pathWithPoints(store, id, 'n');
  wanted.id = old.id, wanted.path.target_patient = {9, 9, 9};
  const Path replaced = store.replacePath(wanted).value();
  EXPECT_NE(replaced.id, old.id);
  EXPECT_FALSE(replaced.drilled);
  const auto listed = store.paths(id).value();
  ASSERT_EQ(listed.size(), 1u) << "the old one is no longer in the plan";
  EXPECT_EQ(listed[0].id, replaced.id);
  EXPECT_EQ(store.findCase(id).value().paths, 1);
  // A drill that was under way ends afterwards, and finds all that it started from.
  ASSERT_TRUE(store.addRecording({"", id, old.id, "", 7, true, "{}", std::string(64, 'c')}).has_value());
  const Path found = store.findPath(id, old.id).value();
  EXPECT_TRUE(found.retired);
  EXPECT_EQ(found.replaced_by, replaced.id);
  EXPECT_EQ(found.path.target_patient, old.path.target_patient);
  EXPECT_TRUE(store.blobs().get(found.point_volume).has_value());
  const auto again = store.replacePath(wanted);
  ASSERT_FALSE(again.has_value()) << "the place is taken";
  EXPECT_EQ(again.error().message, "path " + old.id + " is no longer in the plan: path " + replaced.id + " is");
}

TEST(Store, PointsThatAnotherPathNamesStayWhenOneIsRemoved) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string id = store.addCase(exampleCase()).value().id;
  const Path a = store.addPath(pathWithPoints(store, id, 's')).value();
  const Path b = store.addPath(pathWithPoints(store, id, 's')).value();
  ASSERT_EQ(a.point_volume, b.point_volume);
  ASSERT_TRUE(store.removePath(id, a.id).has_value());
  EXPECT_EQ(store.findPath(id, a.id).error().code, ErrorCode::NotFound);
  EXPECT_TRUE(store.blobs().get(b.point_volume).has_value());
  ASSERT_TRUE(store.removePath(id, b.id).has_value());
  EXPECT_EQ(store.blobs().get(b.point_volume).error().code, ErrorCode::NotFound);
  EXPECT_EQ(store.removePath(id, b.id).error().code, ErrorCode::NotFound);
}

TEST(Store, ADrilledPathThatIsRemovedIsOnlyTakenOutOfThePlan) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string id = store.addCase(exampleCase()).value().id;
  const Path path = store.addPath(pathWithPoints(store, id, 'p')).value();
  ASSERT_TRUE(store.addRecording({"", id, path.id, "", 7, true, "{}", std::string(64, 'c')}).has_value());
  EXPECT_TRUE(store.removePath(id, path.id).value().drilled);
  EXPECT_TRUE(store.paths(id).value().empty());
  EXPECT_TRUE(store.findPath(id, path.id).value().retired);
  EXPECT_TRUE(store.blobs().get(path.point_volume).has_value());
}

TEST(Store, AFolderOfTheFirstVersionIsBroughtUpToDateWithItsDrilledPaths) {
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder.path());
  sqlite3* sql = nullptr;
  ASSERT_EQ(sqlite3_open((folder.path() / "spinaltap.db").c_str(), &sql), SQLITE_OK);
  std::string old = "CREATE TABLE schema_version (version INTEGER NOT NULL); INSERT INTO schema_version VALUES (1);";
  for (const char* statement : kMigrations[0]) old += statement == nullptr ? "" : std::string(statement) + ";";
  const std::string zero =
      "{\"dims\":[1,1,1],\"spacing_mm\":[1,1,1],\"origin_patient\":[0,0,0],"
      "\"direction\":[[1,0,0],[0,1,0],[0,0,1]]}";
  old += "INSERT INTO cases VALUES ('c22','old','',0,'" + zero + "','','{}','','','','','');";
  const std::string path =
      "{\"entry_patient\":[0,0,0],\"target_patient\":[0,0,9],\"bit\":{\"diameter_mm\":3,"
      "\"cone_length_mm\":5,\"length_mm\":50},\"volume_radius_mm\":4,\"lead_mm\":4,"
      "\"spacing_mm\":0.1,\"lattice\":{\"spacing_mm\":0.1,\"rings\":40,\"discs\":130,"
      "\"first_disc\":-40}}";
  old += "INSERT INTO paths VALUES ('p22','c22','a','','" + path + "',5,'');";
  old += "INSERT INTO paths VALUES ('p33','c22','b','','" + path + "',5,'');";
  old += "INSERT INTO recordings VALUES ('r22','c22','p22','',1,1,'{}','');";
  ASSERT_EQ(sqlite3_exec(sql, old.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(sql);
  sqlite3_close(sql);
  auto store = Store::open(folder.path()).value();
  const auto paths = store.paths("c22").value();
  ASSERT_EQ(paths.size(), 2u);
  EXPECT_TRUE(paths[0].drilled);
  EXPECT_FALSE(paths[1].drilled);
}

TEST(Store, SeveralProcessesWriteTogether) {
  const test::TemporaryFolder folder;
  constexpr int kProcesses = 4, kCases = 12;
  std::vector<pid_t> children;
  for (int p = 0; p < kProcesses; ++p) {
    const pid_t child = ::fork();  // also races them through the first migration
    if (child == 0) {
      auto store = Store::open(folder.path());
      bool ok = store.has_value();
      for (int i = 0; ok && i < kCases; ++i) ok = store->addCase(exampleCase()).has_value();
      ::_exit(ok ? 0 : 1);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  std::set<std::string> ids;
  auto store = Store::open(folder.path()).value();
  const auto cases = store.cases().value();
  for (const Case& row : cases) ids.insert(row.id);
  EXPECT_EQ(ids.size(), static_cast<std::size_t>(kProcesses * kCases));
}

TEST(Store, SeveralThreadsShareOneStore) {
  const test::TemporaryFolder folder;
  auto store = Store::open(folder.path()).value();
  const std::string id = store.addCase(exampleCase()).value().id;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) {
        EXPECT_TRUE(store.addPath(examplePath(id)).has_value());
        EXPECT_TRUE(store.findCase(id).has_value());
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(store.paths(id).value().size(), 40u);
}

TEST(Store, RefusesAFolderMadeByANewerProgram) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(Store::open(folder.path()).has_value());
  sqlite3* sql = nullptr;
  ASSERT_EQ(sqlite3_open((folder.path() / "spinaltap.db").c_str(), &sql), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(sql, "UPDATE schema_version SET version = 99", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(sql);
  const auto refused = Store::open(folder.path());
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_EQ(refused.error().message,
            "data folder: made by a newer version of spinaltap (schema 99, this program knows 2)");
}

TEST(Store, RefusesWhatIsNotADataBase) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(replaceFile(folder.path() / "spinaltap.db", std::vector<std::byte>(5000, std::byte{'x'})).has_value());
  EXPECT_EQ(Store::open(folder.path()).error().code, ErrorCode::Io);
}

TEST(Store, RefusesAFolderThatCannotBe) { EXPECT_EQ(Store::open("/proc/nothing/here").error().code, ErrorCode::Io); }

TEST(Ids, AreUnlikeEachOtherAndKeepOutOfPaths) {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) seen.insert(randomId('c'));
  EXPECT_EQ(seen.size(), 1000u);  // of 32^7: a repeat has a chance of 1.5e-5
  for (const char* bad : {"", "c", "../x", "c7k2m9x/", "C7K2M9XQ", "c7k2m9xi"}) EXPECT_FALSE(isId(bad)) << bad;
}

TEST(DataFolder, IsTheOptionThenTheVariableThenHome) {
  ::setenv("HOME", "/home/someone", 1);
  ::unsetenv("SPINALTAP_DATA");
  EXPECT_EQ(dataFolder("").value(), "/home/someone/.local/share/spinaltap");
  ::setenv("SPINALTAP_DATA", "/data", 1);
  EXPECT_EQ(dataFolder("").value(), "/data");
  EXPECT_EQ(dataFolder("here").value(), "here");
}

}  // namespace
}  // namespace spinaltap::store
