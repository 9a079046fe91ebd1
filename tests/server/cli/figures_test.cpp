// The whole way on a small phantom, through the real program; the keys against the tables of server/cli/README.md.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "core/recording/recording.h"
#include "tests/server/program.h"
#include "tests/server/small_case.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::test {
namespace {

struct Keys {
  std::set<std::string> always, sometimes;
};

/// The first column of the table under "### name"; keys in *italics* are there only sometimes.
std::map<std::string, Keys> documentedKeys() {
  std::map<std::string, Keys> documented;
  std::ifstream readme(SPINALTAP_CLI_README);
  std::string command;
  for (std::string line; std::getline(readme, line);) {
    if (line.rfind("### ", 0) == 0) command = line.substr(4);
    if (command.empty() || line.rfind("| ", 0) != 0 || line.rfind("| key", 0) == 0) continue;
    std::string column = line.substr(2, line.find(" |", 2) - 2);
    const bool sometimes = column.front() == '*';
    std::erase(column, '*');
    const std::regex word("[A-Za-z0-9_]+");
    for (std::sregex_iterator at(column.begin(), column.end(), word), end; at != end; ++at) {
      (sometimes ? documented[command].sometimes : documented[command].always).insert(at->str());
    }
  }
  return documented;
}

void expectDocumented(const std::string& command, const Json& figures) {
  static const auto documented = documentedKeys();
  ASSERT_TRUE(figures.is_object()) << command << " prints one JSON object";
  ASSERT_TRUE(documented.contains(command)) << command;
  const Keys& keys = documented.at(command);
  for (const auto& key : keys.always) EXPECT_TRUE(figures.contains(key)) << command << " lacks " << key;
  for (const auto& [key, value] : figures.items()) {
    EXPECT_TRUE(keys.always.contains(key) || keys.sometimes.contains(key))
        << command << ": " << key << " is undocumented";
    EXPECT_FALSE(value.is_null()) << command << ": " << key;
  }
}

std::string joined(const Json& point) { return point[0].dump() + "," + point[1].dump() + "," + point[2].dump(); }

/// A small phantom, prepared once.
class Figures : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    phantom_ = json({"phantom", "--out", path("ct"), "--reduce", "3"}, "phantom");
    const Json imported = json({"import", "--from", path("ct"), "--name", "small", "--data", path("data")}, "import");
    case_ = imported.value("case_id", "");
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string path(const std::string& name) { return (folder_->path() / name).string(); }
  static Json json(std::vector<std::string> arguments, const std::string& command) {
    arguments.emplace_back("--json");
    const auto finished = run(arguments);
    EXPECT_EQ(finished.code, 0) << finished.err;
    EXPECT_EQ(finished.err, "") << "no progress when standard error is no terminal";
    const Json figures = finished.json();
    expectDocumented(command, figures);
    return figures;
  }

  static TemporaryFolder* folder_;
  static Json phantom_;
  static std::string case_;
};
TemporaryFolder* Figures::folder_ = nullptr;
Json Figures::phantom_;
std::string Figures::case_;

TEST_F(Figures, OfEveryCommandAreDocumentedFromPhantomToReplay) {
  const std::string data = path("data");
  const Json segmented =
      json({"segment", case_, "--seed", joined(phantom_["seed_point_patient"]), "--data", data}, "segment");
  EXPECT_EQ(segmented["source"], "segmented");
  EXPECT_NEAR(segmented["volume_mm3"].get<double>() / phantom_["bone_mm3"].get<double>(), 1.0, 0.25)
      << "voxels of a millimetre and more, and a threshold";

  const Json made =
      json({"reconstruct", case_, "--tolerance", "0.2", "--sample-spacing", "2", "--cell", "1.5", "--data", data},
           "reconstruct");
  EXPECT_GT(made["samples"], made["centres"]);
  EXPECT_LT(made["residual_rms_mm"], made["residual_max_mm"]);

  const Json whole = json({"export", case_, "--format", "stl", "--out", path("bone.stl"), "--data", data}, "export");
  EXPECT_EQ(whole["triangles"], made["triangles"]);
  EXPECT_EQ(whole["bytes"], std::filesystem::file_size(path("bone.stl")));
  const Json fewer = json(
      {"export", case_, "--format", "ply", "--simplify", "0.2", "--out", path("bone.ply"), "--data", data}, "export");
  EXPECT_EQ(fewer["triangles_before"], made["triangles"]);
  EXPECT_LT(fewer["triangles"], made["triangles"].get<int>() / 2);
  EXPECT_EQ(fewer["bytes"], std::filesystem::file_size(path("bone.ply")));

  const Json& pedicle = phantom_["pedicles"]["left"];
  const Json planned = json({"plan", case_, "--entry", joined(pedicle["entry_patient"]), "--target",
                             joined(pedicle["target_patient"]), "--spacing", "0.25", "--label", "left", "--data", data},
                            "plan");
  EXPECT_GT(planned["points_alive"], planned["points"].get<int>() / 2);

  const std::string path_id = planned["path_id"];
  const Json drilled =
      json({"drill", case_, path_id, "--scene", "on", "--out", path("on.rec"), "--data", data}, "drill");
  EXPECT_GT(drilled["removed"], 1000);
  EXPECT_GT(drilled["peak_thrust_N"], 0);
  EXPECT_TRUE(drilled.contains("breach_mm"));
  EXPECT_NEAR(drilled["depth_max_mm"].get<double>(), planned["length_mm"].get<double>(), 0.011) << "to within a cycle";

  for (const std::string& recording : {path("on.rec"), drilled["recording_id"].get<std::string>()}) {
    const Json replayed = json({"replay", recording, "--data", data}, "replay");
    EXPECT_EQ(replayed["verified"], true);
    EXPECT_EQ(replayed["hash"], drilled["hash"]);
    EXPECT_EQ(replayed["cycles"], drilled["cycles"]);
  }
  const Json not_kept =
      json({"drill", case_, path_id, "--scene", "hand", "--cycles", "500", "--no-store", "--data", data}, "drill");
  EXPECT_EQ(not_kept["cycles"], 500);
  EXPECT_FALSE(not_kept.contains("recording_id"));
  const Json list = json({"cases", "--data", data}, "cases");
  EXPECT_EQ(list["cases"][0]["stage"], "reconstructed");
  EXPECT_EQ(list["cases"][0]["recordings"], 1);
  std::ignore = json({"version"}, "version");
}

TEST_F(Figures, OfAnUnsegmentedCaseSayWhatComesFirst) {
  const auto imported = run({"import", "--from", path("ct"), "--data", path("fresh"), "--json"}).json();
  const std::string id = imported["case_id"];
  EXPECT_EQ(run({"segment", id, "--data", path("fresh")}).err,
            "spinaltap: case " + id + " was imported without a label: give a seed\n");
  EXPECT_EQ(run({"reconstruct", id, "--data", path("fresh")}).err,
            "spinaltap: case " + id + " has no label yet: segment it first\n");
  EXPECT_EQ(run({"export", id, "--format", "stl", "--out", path("none.stl"), "--data", path("fresh")}).err,
            "spinaltap: case " + id + " is not reconstructed yet\n");
  EXPECT_FALSE(std::filesystem::exists(path("none.stl")));
  EXPECT_EQ(run({"plan", id, "--entry", "0,0,0", "--target", "0,0,9", "--data", path("fresh")}).err,
            "spinaltap: case " + id + " is not reconstructed yet\n");
}

TEST_F(Figures, OfATradeoffAreRowsAndPictures) {
  const Json figures = json({"tradeoff", "--surface", "--reduce", "4", "--method", "normal", "--smoothing", "0",
                             "--sample-spacing", "2", "--out", path("pictures")},
                            "tradeoff");
  ASSERT_EQ(figures["rows"].size(), 1U);
  expectDocumented("tradeoff, a row", figures["rows"][0]);
  EXPECT_EQ(figures["rows"][0]["method"], "normal");
  EXPECT_EQ(figures["files"].size(), 5U);
  for (const auto& file : figures["files"]) {
    EXPECT_GT(std::filesystem::file_size(path("pictures/" + file.get<std::string>())), 500U) << file;
  }
}

TEST_F(Figures, OfTheDrillsTradeoffAreRowsARecommendationAndAPage) {
  const Json figures = json({"tradeoff", "--spacing", "0.4,0.25", "--length", "7", "--repeats", "1", "--threads", "1,2",
                             "--scene", "off", "--rate", "1", "--headroom", "1", "--html", path("drill.html")},
                            "tradeoff, the drill");
  ASSERT_EQ(figures["rows"].size(), 8U);
  for (const Json& row : figures["rows"]) expectDocumented("tradeoff, the drill, a row", row);
  // A second for a cycle: the finer one holds, first in double on one thread.
  ASSERT_EQ(figures["recommended_row"], 4);
  EXPECT_NE(figures["recommendation"].get<std::string>().find("0.25 mm in double precision on 1 thread"),
            std::string::npos)
      << figures["recommendation"];
  // A cone of 5 mm and 2 mm of shaft, 3 mm wide.
  const double hole = 3.14159265 * 1.5 * 1.5 * (5.0 / 3 + 2);
  EXPECT_NEAR(figures["swept_mm3"].get<double>() / hole, 1, 1e-3);
  EXPECT_GT(std::filesystem::file_size(path("drill.html")), 10'000U);
}

TEST_F(Figures, OfHandsOverANetworkAreRowsCouplingsASummaryAndAPage) {
  const Json figures = json({"tradeoff", "--haptics", "--rates", "1000,300", "--delays", "20,0", "--jitter", "0",
                             "--loss", "0", "--seconds", "1", "--html", path("hands.html")},
                            "tradeoff, haptics");
  ASSERT_EQ(figures["rows"].size(), 3U * 4 * 2 * 2 * 2) << "bones, hands, rates, delays, ways";
  ASSERT_EQ(figures["stiffest"].size(), 2U * 2 * 2 * 2) << "rates, delays, ways, guards";
  ASSERT_EQ(figures["summary"].size(), 4U);
  for (const Json& row : figures["rows"]) {
    expectDocumented("tradeoff, haptics, a row", row);
    EXPECT_EQ(row["lost"], 0);
    EXPECT_GT(row["force_mean_N"], 0.0) << row;
    EXPECT_NEAR(row["force_rms_percent"].get<double>() * row["force_mean_N"].get<double>(),
                100 * row["force_rms_N"].get<double>(), 0.01 * 100 * row["force_rms_N"].get<double>());
  }
  for (const Json& row : figures["stiffest"]) expectDocumented("tradeoff, haptics, a coupling", row);
  for (const Json& line : figures["summary"]) {
    expectDocumented("tradeoff, haptics, a line of the summary", line);
    for (const std::string way : {"answered", "extrapolated"}) {
      double sum = 0, worst = 0;
      for (const Json& row : figures["rows"]) {
        const bool is_there = row["rate_hz"] == line["rate_hz"] && row["delay_ms"] == line["delay_ms"] &&
                              row["way"] == (way == "answered" ? "as answered" : "extrapolated");
        if (!is_there) continue;
        sum += row["force_rms_percent"].get<double>();
        worst = std::max(worst, row["force_rms_percent"].get<double>());
      }
      EXPECT_NEAR(line[way + "_percent"].get<double>(), sum / 12, 1e-3 * sum / 12);
      EXPECT_EQ(line[way + "_worst_percent"], worst);
    }
    // What is late swings; what is extrapolated does not care (core/tradeoff/haptic_loop.h).
    if (line["delay_ms"] == 20) {
      EXPECT_LT(line["extrapolated_percent"], line["answered_percent"]);
      EXPECT_GT(line["extrapolated_bare_N_mm"].get<double>(), 5 * line["answered_bare_N_mm"].get<double>());
    }
  }
  EXPECT_EQ(figures["summary"][0]["theory_N_mm"], 6.0) << "2 b / T of 0.003 N s/mm and 1 ms";
  EXPECT_EQ(figures["summary"][0]["delay_ms"], 0.0) << "delays in their order, rates as asked for";
  EXPECT_EQ(figures["trace"]["t_s"].size(), 250U);
  EXPECT_GT(std::filesystem::file_size(path("hands.html")), 50'000U);
}

TEST_F(Figures, OfARateThatNothingHoldsSayThatNoneDoes) {
  const Json figures = json({"tradeoff", "--spacing", "0.4", "--length", "7", "--repeats", "1", "--threads", "1",
                             "--scene", "on", "--rate", "1e6", "--headroom", "1000"},
                            "tradeoff, the drill");
  EXPECT_FALSE(figures.contains("recommended_row"));
  EXPECT_EQ(figures["recommendation"].get<std::string>().rfind("None of these holds 1e+06 cycles a second", 0), 0U)
      << figures["recommendation"];
}

TEST_F(Figures, AreALineEachWithoutJson) {
  const auto finished = run({"version"});
  EXPECT_EQ(finished.out.rfind("version  ", 0), 0u) << finished.out;
}

TEST(DrillScene, GivesOneHashWhetherScriptedOrAsATraceAndByEitherExactEngine) {
  const TemporaryFolder folder;
  const std::string trace = (folder.path() / "off.csv").string();
  std::ofstream csv(trace);
  csv << "t_us,x,y,z,ax,ay,az\n";
  for (int i = 0; i < 300; ++i) csv << 1000 * i << ",1,0," << Json(0.01 * i).dump() << ",0,0,1\n";
  csv.close();
  const Json scene = run({"drill", "--volume", "report", "--scene", "off", "--cycles", "300", "--json"}).json();
  EXPECT_EQ(scene["points"], 986958);
  EXPECT_EQ(scene["discs"], 378);
  for (const char* engine : {"bounded", "reference"}) {
    const Json traced = run({"drill", "--volume", "report", "--trace", trace, "--engine", engine, "--json"}).json();
    expectDocumented("drill", traced);
    EXPECT_EQ(traced["hash"], scene["hash"]) << engine;
    EXPECT_EQ(traced["removed"], scene["removed"]) << engine;
    EXPECT_EQ(traced["trace_poses"], 300);
  }
}

TEST(DrillScene, NamesTheLineOfATraceThatIsWrong) {
  const TemporaryFolder folder;
  const std::string trace = (folder.path() / "bad.csv").string();
  std::ofstream(trace) << "0,0,0,0,0,0,1\n1000,0,0\n";
  const auto finished = run({"drill", "--volume", "report", "--trace", trace});
  EXPECT_EQ(finished.code, 1);
  EXPECT_EQ(finished.err, "spinaltap: bad.csv line 2: 7 numbers are needed (t_us, tip x y z, axis x y z), 3 found\n");
}

TEST(DrillScene, CountsRefusedPosesAndGoesOn) {
  const TemporaryFolder folder;
  const std::string trace = (folder.path() / "odd.csv").string();
  std::ofstream(trace) << "0,0,0,0,0,0,1\n1000,nan,0,0,0,0,1\n2000,0,0,1,0,0,0\n3000,0,0,1,0,0,1\n2000,0,0,1,0,0,1\n";
  const Json figures = run({"drill", "--volume", "report", "--trace", trace, "--json"}).json();
  EXPECT_EQ(figures["cycles"], 2);
  EXPECT_EQ(figures["refused"], 3);
}

TEST(DrillScene, SaysWhetherTheWayBetweenTheLastPosesIsCutToItsEnd) {
  const TemporaryFolder folder;
  const std::string trace = (folder.path() / "jump.csv").string();
  const std::string jump = "0,0,0,1,0,0,1\n1000,0,0,20,0,0,1\n";
  std::ofstream(trace) << jump;
  EXPECT_EQ(run({"drill", "--volume", "report", "--trace", trace, "--json"}).json()["behind"], true)
      << "19 mm in a cycle";
  std::ofstream rested(trace);
  rested << jump;
  for (int t_ms = 2; t_ms < 10; ++t_ms) rested << 1000 * t_ms << ",0,0,20,0,0,1\n";
  rested.close();
  EXPECT_EQ(run({"drill", "--volume", "report", "--trace", trace, "--json"}).json()["behind"], false);
}

/// The recording of `file` with one pose moved aside, and sums and hashes as they were: whole, but not true.
void movePose(const std::string& file, std::size_t which, double aside_mm) {
  std::ifstream in(file, std::ios::binary);
  const std::vector<char> bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const recording::Recording before = recording::read(std::as_bytes(std::span(bytes))).value();
  std::ofstream out(file, std::ios::binary);
  const auto sink = [&](std::span<const std::byte> part) {
    return static_cast<bool>(
        out.write(reinterpret_cast<const char*>(part.data()), static_cast<std::streamsize>(part.size())));
  };
  auto writer = recording::Writer::begin(before.header, before.volume, sink).value();
  auto session = session::Session::create(before.volume, before.header.config).value();
  for (std::size_t i = 0; i < before.inputs.size(); ++i) {
    std::vector<std::uint32_t> removed;
    const session::Output output = session.step(before.inputs[i], [&](std::span<const std::uint32_t> some) {
      removed.insert(removed.end(), some.begin(), some.end());
    });
    session::Input input = before.inputs[i];
    if (i == which) input.tip_mm.x += aside_mm;
    ASSERT_TRUE(writer.append(input, output, removed, session.volume()).has_value());
  }
  ASSERT_TRUE(writer.finish().has_value());
}

TEST(Replay, OfAMovedPoseEndsWithOneAndNamesTheCycleAndTheDiscs) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "off.rec").string();
  ASSERT_EQ(run({"drill", "--volume", "report", "--scene", "off", "--cycles", "1500", "--out", file}).code, 0);
  movePose(file, 700, 0.5);
  const auto finished = run({"replay", file, "--json"});
  EXPECT_EQ(finished.code, 1);
  EXPECT_EQ(finished.err, "") << "it did what was asked; the finding is the answer";
  const Json figures = finished.json();
  expectDocumented("replay", figures);
  EXPECT_EQ(figures["verified"], false);
  EXPECT_EQ(figures["complete"], true);
  EXPECT_EQ(figures["first_difference"], 701);
  // At cycle 701 the tip is 7 mm deep.
  ASSERT_FALSE(figures["discs"].empty());
  EXPECT_LE(figures["discs"].back(), 71);
  const std::string finding = figures["finding"];
  EXPECT_EQ(finding.rfind("not verified: differs first at cycle 701, on disc", 0), 0U) << finding;
  const auto shown = run({"replay", file});
  EXPECT_EQ(shown.code, 1);
  EXPECT_NE(shown.out.find(finding + "\n"), std::string::npos);
  const std::string lists = std::to_string(figures["discs"].size()) + " in all]";
  EXPECT_EQ(shown.out.find(lists) != std::string::npos, figures["discs"].size() > 12) << shown.out;
}

TEST(Replay, OfACutRecordingVerifiesWhatIsLeft) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "on.rec").string();
  ASSERT_EQ(run({"drill", "--volume", "report", "--scene", "on", "--cycles", "1500", "--out", file}).code, 0);
  EXPECT_EQ(run({"replay", file, "--json"}).json()["scene"], "on");
  // cut inside the last chunk of inputs: the one before it is left to verify
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 200);
  const auto cut = run({"replay", file, "--json"});
  EXPECT_EQ(cut.json()["complete"], false);
  EXPECT_EQ(cut.json()["inputs"], 1000);
  EXPECT_EQ(cut.json()["finding"], "verified: 1000 cycles re-run, the same state");
  EXPECT_EQ(cut.code, cut.json()["verified"].get<bool>() ? 0 : 1);
  std::filesystem::resize_file(file, 100);
  EXPECT_EQ(run({"replay", file}).code, 1);
}

TEST(RemoteDrill, PrintsFiguresThatAreDocumentedAndWritesForcesRowByRow) {
  const TemporaryFolder folder;
  store::Store store = store::Store::open(folder.path() / "data").value();
  const SmallCase small = makeSmallCase(store);
  const Server server((folder.path() / "data").string());
  const std::string url = "http://127.0.0.1:" + std::to_string(server.port());
  const std::string csv = (folder.path() / "forces.csv").string();
  const auto finished = run({"drill", "--server", url, small.case_id, small.path_id, "--hand", "leaning", "--depth",
                             "2", "--lockstep", "--forces", csv, "--json"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(finished.err, "");
  const Json figures = finished.json();
  expectDocumented("drill, on a server", figures);
  EXPECT_EQ(figures["reached"], true);
  EXPECT_GE(figures["depth_mm"], 0.5);
  EXPECT_EQ(figures["cycles"], figures["poses"]);
  EXPECT_LE(figures["most_given_mJ"], 1e-9);
  std::ifstream in(csv);
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line.rfind("t_us,depth_mm,thrust_N,side_x_N,side_y_N,torque_Nmm,tip_x_mm,tip_y_mm,tip_z_mm,removed,", 0),
            0U)
      << "as offline: " << line;
  int rows = 0;
  std::uint64_t removed = 0;
  for (; std::getline(in, line); ++rows) {
    std::vector<std::string> cells;
    std::stringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 17U) << line;
    removed += std::stoull(cells[9]);
  }
  EXPECT_EQ(rows, figures["answered"]);
  EXPECT_EQ(removed, figures["removed"]);
  const Json replayed =
      run({"replay", figures["recording_id"], "--data", (folder.path() / "data").string(), "--json"}).json();
  EXPECT_EQ(replayed["verified"], true);
  EXPECT_EQ(replayed["cycles"], figures["poses"]);
}

TEST(RemoteDrill, SaysInOneLineWhatIsWrong) {
  const TemporaryFolder folder;
  const Server server(folder.path().string());
  const std::string url = "http://127.0.0.1:" + std::to_string(server.port());
  const auto failing = [](const std::string& at) {
    const auto finished = run({"drill", "--server", at, "czzzzzzz", "pzzzzzzz"});
    EXPECT_EQ(finished.code, 1);
    EXPECT_EQ(finished.out, "");
    return finished.err;
  };
  EXPECT_EQ(failing(url), "spinaltap: there is no case czzzzzzz\n");
  EXPECT_EQ(failing("https://here"),
            "spinaltap: --server: 'https://here' is no server's address (http://HOST:PORT): "
            "http is what this program speaks\n");
  EXPECT_EQ(failing("http://127.0.0.1:1"), "spinaltap: no server at 127.0.0.1:1: Connection refused\n");
}

TEST(LoadFigures, AreDocumentedAndEveryPoseIsAnswered) {
  const auto finished = run({"load", "--sessions", "3", "--rate", "100", "--seconds", "0.5", "--json"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Json figures = finished.json();
  expectDocumented("load", figures);
  EXPECT_GT(figures["sent"], 0);
  EXPECT_EQ(figures["unanswered"], 0);
  EXPECT_EQ(figures["echo_unanswered"], 0);
  EXPECT_EQ(figures["sent"].get<int>() + figures["skipped"].get<int>(), 150) << "each tick is accounted for";
}

TEST(LoadFigures, SayWhatRealTimeWasGranted) {
  const auto finished = run({"load", "--sessions", "1", "--rate", "50", "--seconds", "0.2", "--realtime", "--json"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const std::string line = finished.json()["realtime"];
  const std::regex plain("real time: SCHED_FIFO (granted|refused .*), memory .*; generator: SCHED_FIFO .*");
  EXPECT_TRUE(std::regex_match(line, plain)) << line;
}

}  // namespace
}  // namespace spinaltap::test
