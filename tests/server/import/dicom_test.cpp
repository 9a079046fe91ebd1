// DICOM series made in the test: sorting, geometry, HU, and each reason for a refusal.
#include <cmath>

#include "tests/server/import/made_files.h"

namespace spinaltap::importer {
namespace {

constexpr int kSlices = 5;

void nothing(int, DicomElements&) {}

void expectMadeHu(const volume::CtVolume& ct) {
  ASSERT_EQ(ct.hu.size(), ct.grid.voxels());
  for (int k = 0; k < ct.grid.dims[2]; ++k) {
    for (int j = 0; j < kRows; ++j) {
      for (int i = 0; i < kColumns; ++i) ASSERT_EQ(ct.hu[ct.grid.index(i, j, k)], madeHu(i, j, k)) << i << j << k;
    }
  }
}

template <class Change>
Result<ImportedVolume> importChanged(const Change& change, int count = kSlices) {
  const Scratch scratch;
  writeSeries(scratch, count, change);
  return importFrom(scratch.path());
}

void set(DicomElements& slice, DicomTag tag, const std::string& bytes) { slice.at(tag).bytes = bytes; }

TEST(DicomImport, GivesBackTheHuAndGeometryThatWereWritten) {
  const auto result = importChanged(nothing);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  const volume::Grid& grid = result->ct.grid;
  EXPECT_EQ(grid.dims, (std::array<int, 3>{kColumns, kRows, kSlices}));
  EXPECT_EQ(grid.spacing_mm, (Vec3{0.5, 0.75, 2}));
  EXPECT_EQ(grid.origin_patient, (Vec3{-10, 20, 30}));
  EXPECT_EQ(grid.direction, Mat3{});
  EXPECT_EQ(result->source, SourceKind::DicomSlices);
  EXPECT_FALSE(result->label.has_value());
  expectMadeHu(result->ct);
}

TEST(DicomImport, StartsAtTheLowestSliceWhenPositionsFall) {
  const auto result = importChanged(
      [](int k, DicomElements& slice) { set(slice, {0x0020, 0x0032}, "-10\\20\\" + std::to_string(30 - 2 * k)); });
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_EQ(result->ct.grid.origin_patient, (Vec3{-10, 20, 30 - 2 * (kSlices - 1)}));
  EXPECT_EQ(result->ct.hu[0], madeHu(0, 0, kSlices - 1));
}

TEST(DicomImport, KeepsAnObliqueStackRightHandedAndInPlace) {
  // Rows along (0.8, 0.6, 0), columns along -z: the normal is (-0.6, 0.8, 0).
  const auto result = importChanged([](int k, DicomElements& slice) {
    set(slice, {0x0020, 0x0037}, "0.8\\0.6\\0\\0\\0\\-1");
    set(slice, {0x0020, 0x0032}, std::to_string(1 - 1.2 * k) + "\\" + std::to_string(2 + 1.6 * k) + "\\3");
  });
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectMadeHu(result->ct);
  const volume::Grid& grid = result->ct.grid;
  const Vec3 at = grid.toPatient({1, 2, 3});
  EXPECT_NEAR(at.x, 1 - 3.6 + 0.4, 1e-9);
  EXPECT_NEAR(at.y, 2 + 4.8 + 0.3, 1e-9);
  EXPECT_NEAR(at.z, 3 - 1.5, 1e-9);
  EXPECT_GT(dot(cross(grid.direction.col_x, grid.direction.col_y), grid.direction.col_z), 0.999);
}

TEST(DicomImport, AppliesEachSlicesOwnRescale) {
  const auto result = importChanged([](int k, DicomElements& slice) {
    set(slice, {0x0028, 0x1053}, "0.5");
    set(slice, {0x0028, 0x1052}, std::to_string(-1024 - k));
    std::string cells;
    for (int j = 0; j < kRows; ++j) {
      for (int i = 0; i < kColumns; ++i) cells += words({2 * (madeHu(i, j, k) + 1024 + k)});
    }
    set(slice, {0x7fe0, 0x0010}, cells);
  });
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectMadeHu(result->ct);
}

TEST(DicomImport, ExtendsTheSignOfTwelveStoredBitsAndIgnoresTheBitsAbove) {
  const auto result = importChanged([](int k, DicomElements& slice) {
    set(slice, {0x0028, 0x0103}, words({1}));
    set(slice, {0x0028, 0x1052}, "0");
    std::string cells;
    for (int j = 0; j < kRows; ++j) {
      for (int i = 0; i < kColumns; ++i) cells += words({(madeHu(i, j, k) & 0x0fff) | 0x5000});
    }
    set(slice, {0x7fe0, 0x0010}, cells);
  });
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectMadeHu(result->ct);
}

TEST(DicomImport, TurnsPaddingIntoAir) {
  const auto result = importChanged([](int, DicomElements& slice) {
    slice[{0x0028, 0x0120}] = {"US", words({4000})};
    std::string cells = slice.at({0x7fe0, 0x0010}).bytes;
    cells.replace(0, 2, words({4000}));
    set(slice, {0x7fe0, 0x0010}, cells);
  });
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_EQ(result->ct.hu[0], -1024);
  EXPECT_EQ(result->ct.hu[1], madeHu(1, 0, 0));
  ASSERT_EQ(result->notes.size(), 1u);
  EXPECT_NE(result->notes[0].find("padding"), std::string::npos);
}

TEST(DicomImport, TurnsARangeOfPaddingIntoAir) {
  const auto result = importChanged([](int, DicomElements& slice) {
    slice[{0x0028, 0x0120}] = {"US", words({0})};
    slice[{0x0028, 0x0121}] = {"US", words({24})};  // HU -1024 .. -1000: voxel (0, 0, 0) alone
  });
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_EQ(result->ct.hu[0], -1024);
  EXPECT_EQ(result->ct.hu[1], madeHu(1, 0, 0));
}

TEST(DicomImport, ReadsABareDataSetWithoutPreamble) {
  const Scratch scratch;
  for (int k = 0; k < kSlices; ++k) scratch.write(sliceName(k), explicitElements(madeSlice(k)));
  const auto result = importFrom(scratch.path());
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectMadeHu(result->ct);
}

TEST(DicomImport, FindsSlicesInSubfoldersAndPassesOverWhatIsNotDicom) {
  const Scratch scratch;
  for (int k = 0; k < kSlices; ++k) {
    scratch.write((k % 2 == 0 ? "a/" : "b/c/") + sliceName(k), part10(madeSlice(k)));
  }
  scratch.write("a/notes.txt", "SECRET notes");
  scratch.write("empty", "");
  std::filesystem::create_symlink("/etc/passwd", scratch.path() / "link.dcm");
  const auto result = importFrom(scratch.path());
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectMadeHu(result->ct);
  ASSERT_EQ(result->notes.size(), 2u);
  EXPECT_EQ(result->notes[0], "skipped, not DICOM: notes.txt, empty");
  EXPECT_EQ(result->notes[1], "skipped, links are not followed: link.dcm");
}

TEST(DicomImport, PicksASeriesByTheNumberThatTheRefusalGives) {
  const Scratch scratch;
  for (int k = 0; k < kSlices; ++k) {
    DicomElements other = madeSlice(k);
    set(other, {0x0020, 0x000e}, "1.2.3.4.55");
    set(other, {0x0028, 0x1052}, "-1000");
    scratch.write("second/" + sliceName(k), part10(other));
    scratch.write("first/" + sliceName(k), part10(madeSlice(k)));
  }
  ImportRequest request;
  request.from = scratch.path();
  expectRefusal(importVolume(request), "mixed series: the folder holds 2");
  request.series = 2;
  const auto second = importVolume(request);
  ASSERT_TRUE(second.has_value()) << second.error().message;
  EXPECT_EQ(second->ct.hu[0], madeHu(0, 0, 0) + 24);
  request.series = 3;
  expectRefusal(importVolume(request), "no series 3");
}

TEST(DicomImport, ReadsAMultiFrameImageWithItsFunctionalGroups) {
  DicomElements image = madeSlice(0);
  set(image, {0x0008, 0x0016}, "1.2.840.10008.5.1.4.1.1.2.1");
  image[{0x0028, 0x0008}] = {"IS", std::to_string(kSlices)};
  std::string cells, per_frame;
  for (int f = 0; f < kSlices; ++f) {
    const int k = (f * 2) % kSlices;  // frames are not in the order of their positions
    const DicomElements slice = madeSlice(k);
    cells += slice.at({0x7fe0, 0x0010}).bytes;
    per_frame += item({{{0x0020, 0x9113}, {"SQ", item({{{0x0020, 0x0032}, slice.at({0x0020, 0x0032})}})}}});
  }
  const std::string shared = item({
      {{0x0020, 0x9116}, {"SQ", item({{{0x0020, 0x0037}, image.at({0x0020, 0x0037})}})}},
      {{0x0028, 0x9110}, {"SQ", item({{{0x0028, 0x0030}, image.at({0x0028, 0x0030})}})}},
      {{0x0028, 0x9145}, {"SQ", item({{{0x0028, 0x1052}, {"DS", "-1024"}}, {{0x0028, 0x1053}, {"DS", "1"}}})}},
  });
  for (const DicomTag& tag : {DicomTag{0x0020, 0x0032}, {0x0020, 0x0037}, {0x0028, 0x0030}, {0x0028, 0x1052}}) {
    image.erase(tag);
  }
  image[{0x5200, 0x9229}] = {"SQ", shared};
  image[{0x5200, 0x9230}] = {"SQ", per_frame};
  set(image, {0x7fe0, 0x0010}, cells);
  const Scratch scratch;
  const auto result = importFrom(scratch.write("multi.dcm", part10(image)));
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_EQ(result->source, SourceKind::DicomMultiFrame);
  EXPECT_EQ(result->ct.grid.spacing_mm, (Vec3{0.5, 0.75, 2}));
  expectMadeHu(result->ct);

  image.erase({0x5200, 0x9230});
  expectRefusal(importFrom(scratch.write("multi.dcm", part10(image))), "functional groups");
}

struct Refusal {
  const char* name;
  const char* word;  ///< that the message must hold
  void (*change)(int k, DicomElements& slice);
};

class DicomRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(DicomRefusal, SaysWhatWasWrong) { expectRefusal(importChanged(GetParam().change), GetParam().word); }

const Refusal kRefusals[] = {
    {"MissingSlice", "1 missing slice",
     [](int k, DicomElements& s) {
       set(s, {0x0020, 0x0032}, "-10\\20\\" + std::to_string(k < 2 ? 2 * k : 2 * k + 2));
     }},
    {"DuplicateSlice", "duplicate",
     [](int k, DicomElements& s) { set(s, {0x0020, 0x0032}, "-10\\20\\" + std::to_string(k == 4 ? 6 : 2 * k)); }},
    {"IrregularSpacing", "irregular",
     [](int k, DicomElements& s) { set(s, {0x0020, 0x0032}, "-10\\20\\" + std::to_string(k == 4 ? 9.1 : 2.0 * k)); }},
    {"SlowlyDriftingSpacing", "irregular",
     [](int k, DicomElements& s) { set(s, {0x0020, 0x0032}, "-10\\20\\" + std::to_string(2.0 * k + 0.03 * k * k)); }},
    {"ShearedStack", "sheared",
     [](int k, DicomElements& s) {
       set(s, {0x0020, 0x0032}, std::to_string(0.02 * k) + "\\20\\" + std::to_string(2 * k));
     }},
    {"MixedOrientation", "orientation",
     [](int k, DicomElements& s) {
       if (k == 3) set(s, {0x0020, 0x0037}, "0\\1\\0\\1\\0\\0");
     }},
    {"MixedSpacing", "pixel spacing",
     [](int k, DicomElements& s) {
       if (k == 3) set(s, {0x0028, 0x0030}, "0.75\\0.51");
     }},
    {"MixedFrameOfReference", "frame of reference",
     [](int k, DicomElements& s) {
       if (k == 3) set(s, {0x0020, 0x0052}, "1.2.9");
     }},
    {"SameSopInstance", "SOPInstanceUID", [](int, DicomElements& s) { set(s, {0x0008, 0x0018}, "1.2.3"); }},
    {"MixedModality", "mixed series",
     [](int k, DicomElements& s) {
       if (k == 3) set(s, {0x0008, 0x0060}, "PT");
     }},
    {"Localizer", "localizer",
     [](int k, DicomElements& s) {
       if (k == 1) set(s, {0x0008, 0x0008}, "ORIGINAL\\PRIMARY\\LOCALIZER");
     }},
    {"BurnedInAnnotation", "BurnedInAnnotation",
     [](int k, DicomElements& s) {
       if (k == 1) s[{0x0028, 0x0301}] = {"CS", "YES"};
     }},
    {"Colour", "colour",
     [](int k, DicomElements& s) {
       if (k == 1) set(s, {0x0028, 0x0004}, "RGB");
     }},
    {"Monochrome1", "MONOCHROME1", [](int, DicomElements& s) { set(s, {0x0028, 0x0004}, "MONOCHROME1"); }},
    {"MrClass", "an MR image", [](int, DicomElements& s) { set(s, {0x0008, 0x0016}, "1.2.840.10008.5.1.4.1.1.4"); }},
    {"NotHu", "RescaleType", [](int, DicomElements& s) { s[{0x0028, 0x1054}] = {"LO", "Z_EFF"}; }},
    {"OverflowingHu", "do not fit",
     [](int k, DicomElements& s) {
       if (k == 1) set(s, {0x0028, 0x1052}, "40000");
     }},
    {"MissingRescale", "Rescale",
     [](int k, DicomElements& s) {
       if (k == 1) s.erase({0x0028, 0x1052});
     }},
    {"MissingPosition", "ImagePositionPatient",
     [](int k, DicomElements& s) {
       if (k == 1) s.erase({0x0020, 0x0032});
     }},
    {"HexadecimalSpacing", "PixelSpacing", [](int, DicomElements& s) { set(s, {0x0028, 0x0030}, "0x1\\0x1"); }},
    {"NoPixels", "no pixel data",
     [](int k, DicomElements& s) {
       if (k == 1) s.erase({0x7fe0, 0x0010});
     }},
    {"ShortPixels", "truncated",
     [](int k, DicomElements& s) {
       if (k == 1) s.at({0x7fe0, 0x0010}).bytes.resize(2 * kRows * kColumns - 2);
     }},
    {"LongPixels", "surplus",
     [](int k, DicomElements& s) {
       if (k == 1) s.at({0x7fe0, 0x0010}).bytes.resize(2 * kRows * kColumns + 2);
     }},
    {"FramesWithoutGeometry", "frames", [](int, DicomElements& s) { s[{0x0028, 0x0008}] = {"IS", "2"}; }},
};

INSTANTIATE_TEST_SUITE_P(Made, DicomRefusal, testing::ValuesIn(kRefusals),
                         [](const testing::TestParamInfo<Refusal>& param) { return std::string(param.param.name); });

TEST(DicomImport, RefusesASingleSliceUnlessATestAsksForIt) {
  const Scratch scratch;
  ImportRequest request;
  request.from = scratch.write("one.dcm", part10(madeSlice(0)));
  expectRefusal(importVolume(request), "a single slice");
  request.allow_single_slice = true;
  const auto result = importVolume(request);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectMadeHu(result->ct);
}

TEST(DicomImport, RefusesAFileCutAtAnyByte) {
  const Scratch scratch;
  const std::string whole = part10(madeSlice(0));
  ImportRequest request;
  request.allow_single_slice = true;
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    request.from = scratch.write("cut.dcm", whole.substr(0, size));
    const auto result = importVolume(request);
    ASSERT_FALSE(result.has_value()) << "cut at " << size;
    expectClean(result.error());
    EXPECT_NE(result.error().message.find("cut.dcm"), std::string::npos) << result.error().message;
  }
}

TEST(DicomImport, AcceptsPositionsAtTheToleranceAndRefusesThoseBeyond) {
  // 2 mm steps: a fiftieth is 0.04 mm, below the 0.05 mm that hold for thick slices.
  const auto shifted = [](double mm) {
    return importChanged([mm](int k, DicomElements& s) {
      set(s, {0x0020, 0x0032}, "-10\\20\\" + std::to_string(2.0 * k + (k == 2 ? mm : 0)));
    });
  };
  EXPECT_TRUE(shifted(0.039).has_value());
  EXPECT_FALSE(shifted(0.041).has_value());
}

TEST(DicomImport, RefusesWhatExceedsTheLimitsOfTheRequest) {
  const Scratch scratch;
  writeSeries(scratch, kSlices, nothing);
  ImportRequest request;
  request.from = scratch.path();
  request.limits.voxels = kSlices * kRows * kColumns - 1;
  expectRefusal(importVolume(request), "over the limit");
  request.limits = {};
  request.limits.files = kSlices - 1;
  expectRefusal(importVolume(request), "more than 4 files");
  request.limits = {};
  request.limits.input_bytes = 1000;
  expectRefusal(importVolume(request), "larger than");
  request.limits = {};
  request.limits.wall_time = std::chrono::milliseconds(0);
  const auto late = importVolume(request);
  ASSERT_FALSE(late.has_value());
  EXPECT_EQ(late.error().code, ErrorCode::Limit);
}

TEST(DicomImport, NamesWhatDoesNotExistWithoutItsPath) {
  const Scratch scratch;
  const auto missing = importFrom(scratch.path() / "nowhere");
  expectRefusal(missing, "nowhere: no such file or folder");
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  expectRefusal(importFrom(scratch.path()), "no DICOM file");
  expectRefusal(importFrom("/dev/zero"), "not a regular file");
}

TEST(DicomImport, ShowsFileNamesWithoutTheirControlCharacters) {
  const Scratch scratch;
  expectRefusal(importFrom(scratch.write("a\x1b[31m\n.dcm", "rubbish")), "a?[31m?.dcm");
}

TEST(DicomImport, ReportsProgressToTheLastSlice) {
  const Scratch scratch;
  writeSeries(scratch, kSlices, nothing);
  ImportRequest request;
  request.from = scratch.path();
  std::map<std::string, std::uint64_t> highest;
  ASSERT_TRUE(importVolume(request, [&](const ImportProgress& p) { highest[p.stage] = p.done; }).has_value());
  EXPECT_EQ(highest["read"], static_cast<std::uint64_t>(kSlices));
  EXPECT_EQ(highest["decode"], static_cast<std::uint64_t>(kSlices - 1));
}

}  // namespace
}  // namespace spinaltap::importer
