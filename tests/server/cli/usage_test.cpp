// How the program answers: exit codes, one line on standard error, help that names every option.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "tests/server/program.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::test {
namespace {

const std::vector<std::string> kCommands{"phantom", "import", "segment", "reconstruct", "plan",   "drill",
                                         "replay",  "serve",  "cases",   "version",     "export", "tradeoff"};

void expectOneLine(const Finished& finished, int code) {
  EXPECT_EQ(finished.code, code) << finished.err;
  EXPECT_EQ(finished.out, "");
  EXPECT_EQ(finished.err.rfind("spinaltap: ", 0), 0u) << finished.err;
  EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
  EXPECT_EQ(finished.err.back(), '\n');
}

TEST(Usage, HelpListsEveryCommandAndEveryCommandHasHelpAndJson) {
  const auto help = run({"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.err, "");
  for (const auto& command : kCommands) {
    EXPECT_NE(help.out.find("\n  " + command + " "), std::string::npos) << command;
    const auto own = run({command, "--help"});
    EXPECT_EQ(own.code, 0) << command;
    EXPECT_NE(own.out.find("--json"), std::string::npos) << command;
  }
}

TEST(Usage, WrongUsageEndsWithTwoAndOneLine) {
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {},
           {"bogus"},
           {"--bogus"},
           {"import"},
           {"import", "--from", "x", "--label-value", "3"},
           {"segment", "c7", "--seed", "1,2"},
           {"segment", "c7", "--threshold", "200"},
           {"export", "c7"},
           {"export", "c7", "--format", "obj", "--out", "a.obj"},
           {"export", "c7", "--format", "stl", "--out", "a.stl", "--simplify", "0"},
           {"plan", "c7", "--entry", "1,2,3"},
           {"plan", "c7", "--entry", "1,2,x", "--target", "1,2,3"},
           {"plan", "c7", "--entry", "1,2,nan", "--target", "1,2,3"},
           {"plan", "c7", "--entry", "1,2,3", "--target", "1,2,3", "--spacing", "wide"},
           {"drill"},
           {"drill", "c7"},
           {"drill", "c7", "p7"},
           {"drill", "c7", "p7", "--scene", "sideways"},
           {"drill", "c7", "p7", "--scene", "on", "--trace", "a.csv"},
           {"drill", "c7", "p7", "--volume", "report", "--scene", "on"},
           {"drill", "--volume", "report"},
           {"drill", "--volume", "huge", "--scene", "on"},
           {"drill", "--volume", "report", "--scene", "on", "--engine", "steam"},
           {"drill", "--volume", "report", "--scene", "on", "--cycles", "-1"},
           {"drill", "c7", "p7", "--hand", "tense"},
           {"drill", "c7", "p7", "--server", "http://localhost:1", "--hand", "strong"},
           {"drill", "c7", "p7", "--server", "http://localhost:1", "--scene", "on"},
           {"drill", "c7", "p7", "--server", "http://localhost:1", "--speed", "800"},
           {"drill", "c7", "p7", "--server", "http://localhost:1", "--rate", "10000"},
           {"drill", "c7", "p7", "--server", "http://localhost:1", "--lockstep", "--realtime"},
           {"drill", "--server", "http://localhost:1"},
           {"replay"},
           {"tradeoff", "c7"},
           {"tradeoff", "--reduce", "4"},
           {"tradeoff", "--spacing", "0.001"},
           {"tradeoff", "--spacing", "fine"},
           {"tradeoff", "--threads", "3"},
           {"tradeoff", "--rate", "0"},
           {"tradeoff", "--full", "--length", "9"},
           {"tradeoff", "--surface", "--html", "a.html"},
           {"tradeoff", "--surface", "--method", "voxel"},
           {"tradeoff", "--rates", "1000"},
           {"tradeoff", "--haptics", "--rates", "49"},
           {"tradeoff", "--haptics", "--rates", "300,quick"},
           {"tradeoff", "--haptics", "--delays", "0,1001"},
           {"tradeoff", "--haptics", "--delays", "-1"},
           {"tradeoff", "--haptics", "--loss", "0.95"},
           {"tradeoff", "--haptics", "--jitter", "-1"},
           {"tradeoff", "--haptics", "--seconds", "60"},
           {"tradeoff", "--haptics", "--spacing", "0.1"},
           {"tradeoff", "--haptics", "--surface"},
           {"tradeoff", "c7", "--surface", "--reduce", "2"},
           {"reconstruct", "c7", "--method", "voxel"},
           {"serve", "--port", "http"}}) {
    std::string shown;
    for (const auto& word : wrong) shown += word + " ";
    SCOPED_TRACE(shown);
    expectOneLine(run(wrong), 2);
  }
}

TEST(Usage, FailuresEndWithOneAndOneLineThatNamesTheInput) {
  const TemporaryFolder folder;
  const std::string data = (folder.path() / "data").string();
  const auto failing = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--data", data});
    const auto finished = run(arguments);
    expectOneLine(finished, 1);
    EXPECT_EQ(finished.err.find(folder.path().string()), std::string::npos) << "an absolute path: " << finished.err;
    return finished.err;
  };
  EXPECT_EQ(failing({"segment", "czzzzzzz"}), "spinaltap: there is no case czzzzzzz\n");
  EXPECT_EQ(failing({"reconstruct", "czzzzzzz"}), "spinaltap: there is no case czzzzzzz\n");
  EXPECT_EQ(failing({"plan", "czzzzzzz", "--entry", "0,0,0", "--target", "0,0,9"}),
            "spinaltap: there is no case czzzzzzz\n");
  EXPECT_EQ(failing({"drill", "czzzzzzz", "pzzzzzzz", "--scene", "on"}), "spinaltap: there is no case czzzzzzz\n");
  EXPECT_EQ(failing({"replay", "rzzzzzzz"}), "spinaltap: there is no recording rzzzzzzz\n");
  std::ignore = failing({"replay", (folder.path() / "missing.rec").string()});
  std::ignore = failing({"import", "--from", (folder.path() / "missing").string()});
  std::ignore = failing({"drill", "--volume", "report", "--trace", (folder.path() / "missing.csv").string()});
}

TEST(Usage, CoordinatesMayBeNegativeInEveryForm) {
  const TemporaryFolder folder;
  for (const std::vector<std::string>& form : std::vector<std::vector<std::string>>{{"--entry", "-1,-2.5,3"},
                                                                                    {"--entry=-1,-2.5,3"},
                                                                                    {"--entry", "-1 -2.5 3"},
                                                                                    {"--entry", "-1, -2.5, 3"},
                                                                                    {"--entry", "-1e0,-25e-1,+3"}}) {
    std::vector<std::string> arguments{"plan", "czzzzzzz", "--target", "-1,-2,-3", "--data", folder.path().string()};
    arguments.insert(arguments.end(), form.begin(), form.end());
    EXPECT_EQ(run(arguments).err, "spinaltap: there is no case czzzzzzz\n") << form[0];
  }
}

TEST(Usage, VersionTellsTheEngines) {
  const Json version = run({"version", "--json"}).json();
  EXPECT_EQ(version["engines"].size(), 4u);
  EXPECT_EQ(run({"--version"}).out, version["version"].get<std::string>() + "\n");
}

}  // namespace
}  // namespace spinaltap::test
