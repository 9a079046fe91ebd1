// From files to a drilled, replayed hole, through the real program: the phantom, a labelled NIfTI scan, a scanner's
// slices.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "tests/server/program.h"
#include "tests/server/temporary_folder.h"

namespace spinaltap::test {
namespace {
namespace fs = std::filesystem;

std::string joined(const Json& point) { return point[0].dump() + "," + point[1].dump() + "," + point[2].dump(); }

class EndToEnd : public testing::Test {
 protected:
  TemporaryFolder folder_;
  const fs::path ct_ = fs::path(SPINALTAP_SHARED_DATA) / "ct";

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  Json json(std::vector<std::string> arguments, bool with_data = true) {
    if (with_data) arguments.insert(arguments.end(), {"--data", path("data")});
    arguments.emplace_back("--json");
    const auto finished = run(arguments);
    EXPECT_EQ(finished.code, 0) << arguments[0] << ": " << finished.err;
    const Json figures = finished.json();
    std::printf("  %-11s %6.2f s\n", arguments[0].c_str(), figures.value("total_s", 0.0));
    return figures;
  }

  /// Plans, drills with an unsteady hand, and replays. The figures of the drill.
  Json drillAndReplay(const std::string& case_id, const std::string& entry, const std::string& target) {
    const Json planned = json({"plan", case_id, "--entry", entry, "--target", target});
    EXPECT_GT(planned["points_alive"], planned["points"].get<int>() / 4);
    const Json drilled =
        json({"drill", case_id, planned["path_id"].get<std::string>(), "--scene", "hand", "--out", path("hand.rec")});
    const Json replayed = json({"replay", path("hand.rec")});
    EXPECT_EQ(replayed["verified"], true);
    EXPECT_EQ(replayed["complete"], true);
    EXPECT_EQ(replayed["hash"], drilled["hash"]);
    EXPECT_EQ(replayed["cycles"], drilled["cycles"]);
    // The bit alone sweeps pi/4 * 9 mm^2 a mm; the hand widens that by the tilt of its shaft.
    const double length_mm = planned["length_mm"];
    EXPECT_GT(drilled["removed_mm3"], 0.75 * 7 * length_mm);
    EXPECT_NEAR(drilled["depth_max_mm"].get<double>(), length_mm, 0.01);
    EXPECT_LT(drilled["tip_error_mm"], 0.5);
    EXPECT_GT(drilled["peak_thrust_N"], drilled["mean_thrust_N"]);
    return drilled;
  }
};

TEST_F(EndToEnd, ThePhantomBecomesAHoleInEachPedicleWithoutABreach) {
  const Json phantom = json({"phantom", "--out", path("ct")}, false);
  const std::string id = json({"import", "--from", path("ct"), "--name", "Phantom L3"})["case_id"];
  const Json segmented = json({"segment", id, "--seed", joined(phantom["seed_point_patient"])});
  EXPECT_NEAR(segmented["volume_mm3"].get<double>() / phantom["bone_mm3"].get<double>(), 1, 0.1);
  const Json made = json({"reconstruct", id});
  EXPECT_LT(made["residual_rms_mm"], 0.1);
  for (const char* side : {"left", "right"}) {
    const Json& pedicle = phantom["pedicles"][side];
    const Json drilled = drillAndReplay(id, joined(pedicle["entry_patient"]), joined(pedicle["target_patient"]));
    EXPECT_EQ(drilled["gertzbein_robbins"], "A") << side << ", " << drilled["breach_mm"] << " mm";
    EXPECT_EQ(drilled["plunge_mm"], 0.0);
  }
}

TEST_F(EndToEnd, AHoleBesideThePedicleIsABreach) {
  const Json phantom = json({"phantom", "--out", path("ct"), "--reduce", "2"}, false);
  const std::string id = json({"import", "--from", path("ct")})["case_id"];
  std::ignore = json({"segment", id, "--seed", joined(phantom["seed_point_patient"])});
  std::ignore = json({"reconstruct", id, "--tolerance", "0.1"});
  const Json& pedicle = phantom["pedicles"]["left"];
  Json entry = pedicle["entry_patient"], target = pedicle["target_patient"];
  // towards the middle by half the pedicle's width: the bit's side comes out by about its radius
  const double shift = 0.5 * pedicle["width_mm"].get<double>();
  entry[0] = entry[0].get<double>() - shift;
  target[0] = target[0].get<double>() - shift;
  const Json planned = json({"plan", id, "--entry", joined(entry), "--target", joined(target), "--spacing", "0.2"});
  const Json drilled = json({"drill", id, planned["path_id"].get<std::string>(), "--scene", "on"});
  EXPECT_GT(drilled["breach_mm"], 0.5);
  EXPECT_LT(drilled["breach_mm"], 3.0);
  EXPECT_EQ(drilled["breach_direction"], "medial");
  EXPECT_NE(drilled["gertzbein_robbins"], "A");
}

TEST_F(EndToEnd, ALabelledScanBecomesAHole) {
  if (!fs::exists(ct_)) GTEST_SKIP() << "the folder of shared data is absent";
  const fs::path scan = ct_ / "verse-014";
  const Json imported = json({"import", "--from", scan / "sub-verse014_ct.nii.gz", "--label",
                              scan / "sub-verse014_seg-vert_msk.nii.gz", "--label-value", "22", "--name", "L3"});
  const std::string id = imported["case_id"];
  EXPECT_GT(imported["label_voxels"], 20'000);
  EXPECT_EQ(json({"segment", id})["source"], "imported");
  std::ignore = json({"reconstruct", id});
  const Json drilled = drillAndReplay(id, "-41.7,200.1,-129.0", "-37.4,172.0,-122.2");
  EXPECT_EQ(drilled["gertzbein_robbins"], "A");
}

TEST_F(EndToEnd, AScannersOwnSlicesBecomeAHole) {
  if (!fs::exists(ct_)) GTEST_SKIP() << "the folder of shared data is absent";
  const std::string id = json({"import", "--from", ct_ / "pancreas-cb-001" / "dicom"})["case_id"];
  const Json segmented = json({"segment", id, "--seed", "6,110,220"});
  EXPECT_EQ(segmented["actions"], 1);
  EXPECT_EQ(segmented["neighbours"].size(), 2U);
  std::ignore = json({"reconstruct", id});
  const Json drilled = drillAndReplay(id, "-17.1,144.2,224.6", "-0.2,112.0,225.0");
  EXPECT_EQ(drilled["gertzbein_robbins"], "A");
}

}  // namespace
}  // namespace spinaltap::test
