// Real scans: one slice in every encoding, whole series, multi-frame images, NIfTI files and labels.
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/server/import/shared_data.h"

namespace spinaltap::importer {
namespace {

struct Encoding {
  const char* start;
  int largest_difference;  ///< of any HU from encoding 01, from the README of the data
};
const Encoding kEncodings[] = {{"02", 0}, {"03", 0}, {"04", 0},  {"05", 0}, {"06", 0}, {"07", 0}, {"08", 9}, {"09", 0},
                               {"10", 3}, {"11", 0}, {"12", 16}, {"13", 0}, {"14", 0}, {"15", 0}, {"16", 0}};

fs::path encodingFile(const std::string& start) {
  for (const fs::directory_entry& entry : fs::directory_iterator(kShared / "dicom/syntaxes")) {
    if (entry.path().filename().string().substr(0, 2) == start) return entry.path();
  }
  return {};
}

int largestDifference(const std::vector<std::int16_t>& a, const std::vector<std::int16_t>& b) {
  int largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

TEST(DicomData, DecodesOneSliceToTheSameHuFromAllEncodings) {
  NEED_SHARED_DATA();
  const auto control = importSlice(encodingFile("01"));
  ASSERT_TRUE(control.has_value());
  EXPECT_EQ(*std::min_element(control->ct.hu.begin(), control->ct.hu.end()), -1000);
  EXPECT_EQ(*std::max_element(control->ct.hu.begin(), control->ct.hu.end()), 1188);
  for (const Encoding& encoding : kEncodings) {
    const auto result = importSlice(encodingFile(encoding.start));
    ASSERT_TRUE(result.has_value()) << encoding.start << ": " << result.error().message;
    EXPECT_EQ(result->ct.grid, control->ct.grid) << encoding.start;
    EXPECT_EQ(largestDifference(result->ct.hu, control->ct.hu), encoding.largest_difference) << encoding.start;
  }
}

TEST(DicomData, MasksPaddingOutsideTheReconstructionCircle) {
  NEED_SHARED_DATA();
  const auto control = importSlice(encodingFile("01"));
  const auto padded = importSlice(encodingFile("17"));
  ASSERT_TRUE(control.has_value() && padded.has_value());
  std::size_t masked = 0;
  for (std::size_t i = 0; i < control->ct.hu.size(); ++i) {
    if (padded->ct.hu[i] == -1024) {
      ++masked;
    } else {
      ASSERT_EQ(padded->ct.hu[i], control->ct.hu[i]);
    }
  }
  // Outside the circle that touches the four sides lies 1 - pi/4 of a square.
  EXPECT_NEAR(static_cast<double>(masked) / 262144, 1 - 3.14159265358979323846 / 4, 0.01);
}

const Expected kSyntaxes[] = {
    {"CTImage.dcm_JPEGProcess1TransferSyntax_1.2.840.10008.1.2.4.50.dcm", nullptr},
    {"CTImage.dcm_JPEGProcess6_8TransferSyntax_1.2.840.10008.1.2.4.53.dcm", nullptr},
    {"CTImage.dcm_JPEGProcess10_12TransferSyntax_1.2.840.10008.1.2.4.55.dcm", nullptr},
    {"CT0012.fragmented_no_bot_jpeg_baseline.51.dcm", nullptr},
    {"CT1_J2KR", nullptr},
    {"D_CLUNIE_CT1_RLE_FRAGS.dcm", nullptr},
    {"HTJ2KLossless_08_RGB.dcm", "transfer syntax"},
    {"JLSL_16_15_1_1F.dcm", "secondary capture"},
};
const Expected kSingles[] = {
    {"CT_small.dcm", nullptr},
    {"no_meta.dcm", "not a DICOM file"},  // it begins one byte late: its first tag is torn
    {"eCT_Supplemental.dcm", nullptr},
    {"dcmqi_24x38x3_multiframe.dcm", nullptr},
    {"MR_small.dcm", "MR image"},
    {"MR_small_padded.dcm", "MR image"},
    {"emri_small_jpeg_2k_lossless.dcm", "MR image"},
    {"SC_rgb_small_odd.dcm", "secondary capture"},
    {"image_dfl.dcm", "secondary capture"},
    {"liver_1frame.dcm", "segmentation"},
    {"rtplan.dcm", "radiotherapy"},
    {"reportsi.dcm", "structured report"},
};

TEST(DicomData, EndsOtherSyntaxesAndObjectKindsAsTheirTablesSay) {
  NEED_SHARED_DATA();
  checkTable(kShared / "dicom/other-syntaxes", kSyntaxes, true);
  checkTable(kShared / "dicom/single", kSingles, true);
}

TEST(DicomData, DecodesJpeg2000AndRleOfOneSliceAlike) {
  NEED_SHARED_DATA();
  const auto a = importSlice(kShared / "dicom/other-syntaxes/CT1_J2KR");
  const auto b = importSlice(kShared / "dicom/other-syntaxes/D_CLUNIE_CT1_RLE_FRAGS.dcm");
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_EQ(a->ct.hu, b->ct.hu);
}

TEST(DicomData, ReadsMultiFrameImagesByTheirFunctionalGroups) {
  NEED_SHARED_DATA();
  const auto enhanced = importFrom(kShared / "dicom/single/eCT_Supplemental.dcm");
  ASSERT_TRUE(enhanced.has_value()) << enhanced.error().message;
  EXPECT_EQ(enhanced->source, SourceKind::DicomMultiFrame);
  EXPECT_EQ(enhanced->ct.grid.dims, (std::array<int, 3>{512, 512, 2}));
  const auto narrow = importFrom(kShared / "dicom/single/dcmqi_24x38x3_multiframe.dcm");
  ASSERT_TRUE(narrow.has_value()) << narrow.error().message;
  EXPECT_EQ(narrow->ct.grid.dims, (std::array<int, 3>{24, 38, 3}));
}

TEST(DicomData, LoadsASeriesWithoutUidsAndItsLabelWithTurnedAxes) {
  NEED_SHARED_DATA();
  ImportRequest request;
  request.from = kShared / "dicom/t12-j2k-lossless";
  request.label = LabelRequest{request.from / "example_seg_dicom.nii.gz", 32};
  const auto result = importVolume(request);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_EQ(result->ct.grid.dims, (std::array<int, 3>{512, 512, 20}));
  EXPECT_NEAR(result->ct.grid.spacing_mm.z, 2.0, 1e-6);
  const auto [low, high] = std::minmax_element(result->ct.hu.begin(), result->ct.hu.end());
  EXPECT_EQ(*low, -1024);
  EXPECT_EQ(*high, 1839);
  // Bone lies where the label says: were the label mirrored, the mean would be that of soft tissue or air.
  double sum = 0, count = 0;
  for (std::size_t v = 0; v < result->ct.hu.size(); ++v) {
    if (result->label->inside[v] != 0) sum += result->ct.hu[v], count += 1;
  }
  EXPECT_GT(count, 1000);
  EXPECT_GT(sum / count, 150);
}

TEST(DicomData, RefusesTheTiltedPhantomAndTheDiscOfSeveralStudies) {
  NEED_SHARED_DATA();
  const auto tilted = importFrom(kShared / "dicom/tilt-phantom");
  ASSERT_FALSE(tilted.has_value());
  EXPECT_NE(tilted.error().message.find("16.5 degrees off"), std::string::npos) << tilted.error().message;
  const auto disc = importFrom(kShared / "dicom/dicomdir");
  ASSERT_FALSE(disc.has_value());
  EXPECT_NE(disc.error().message.find("mixed series"), std::string::npos) << disc.error().message;
  expectNoNames(disc.error());
}

TEST(CtData, ReadsTheScannersSeriesVoxelForVoxelLikeItsPublishedCrop) {
  NEED_SHARED_DATA();
  const auto series = importFrom(kShared / "ct/pancreas-cb-001/dicom");
  const auto crop = importFrom(kShared / "ct/pancreas-cb-001/pancreas-cb-001_lumbar.nii.gz");
  ASSERT_TRUE(series.has_value()) << series.error().message;
  ASSERT_TRUE(crop.has_value()) << crop.error().message;
  EXPECT_EQ(series->ct.grid.dims, (std::array<int, 3>{512, 512, 80}));
  ASSERT_EQ(crop->ct.grid.dims, (std::array<int, 3>{170, 170, 80}));
  std::size_t different = 0;
  for (int k = 0; k < 80; ++k) {
    for (int j = 0; j < 170; ++j) {
      for (int i = 0; i < 170; ++i) {
        // NIfTI axes L P S became i, j, k as they are; the crop is columns 176.., rows 210...
        const Vec3 there = crop->ct.grid.toPatient({double(i), double(j), double(k)});
        const Vec3 v = series->ct.grid.toVoxel(there);
        const int x = static_cast<int>(std::lround(v.x)), y = static_cast<int>(std::lround(v.y)),
                  z = static_cast<int>(std::lround(v.z));
        ASSERT_TRUE(x == 176 + i && y == 210 + j && z == k);
        different += series->ct.hu[series->ct.grid.index(x, y, z)] != crop->ct.hu[crop->ct.grid.index(i, j, k)] ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(different, 0u);
}

/// The letter of the direction in which an axis grows.
char letter(const Vec3& axis) {
  const double x = std::abs(axis.x), y = std::abs(axis.y), z = std::abs(axis.z);
  if (x >= y && x >= z) return axis.x > 0 ? 'L' : 'R';
  if (y >= z) return axis.y > 0 ? 'P' : 'A';
  return axis.z > 0 ? 'S' : 'I';
}

std::string letters(const volume::Grid& grid) {
  return {letter(grid.direction.col_x), letter(grid.direction.col_y), letter(grid.direction.col_z)};
}

TEST(CtData, GivesEveryNiftiFileItsAxesRangeAndSpacing) {
  NEED_SHARED_DATA();
  struct Row {
    const char* file;
    const char* axes;
    double spacing_mm;
    int low, high;
  };
  // Axes as the data's README gives them; L A S and the like would come out with the first reversed.
  const Row rows[] = {{"verse-014/sub-verse014_ct.nii.gz", "PIR", 1.0, -1291, 1699},
                      {"pancreas-cb-001/pancreas-cb-001_lumbar.nii.gz", "LPS", 1.07421875, -1000, 1365},
                      {"lidc-0314/lidc-idri-0314_thoracic.nii.gz", "LPS", 0.78125, -1000, 1758},
                      {"tptbox-l3/sub-ct_label-22_ct.nii.gz", "PIR", 1.5, -1030, 1961},
                      {"spinefe-l2/sub-verse004_0000_vertebra_21_im.nii.gz", "LPS", 1.0, -214, 1894},
                      {"spinefe-l2/sub-verse004_0000_vertebra_21_im_reoriented.nii.gz", "RAS", 1.0, -214, 1894},
                      {"totalsegmentator-example/example_ct.nii.gz", "RAS", 3.0, -1207, 3382}};
  for (const Row& row : rows) {
    const auto result = importFrom(kShared / "ct" / row.file);
    ASSERT_TRUE(result.has_value()) << row.file << ": " << result.error().message;
    EXPECT_EQ(letters(result->ct.grid), row.axes) << row.file;
    EXPECT_NEAR(result->ct.grid.spacing_mm.x, row.spacing_mm, 1e-5) << row.file;
    const auto [low, high] = std::minmax_element(result->ct.hu.begin(), result->ct.hu.end());
    EXPECT_EQ(*low, row.low) << row.file;
    EXPECT_EQ(*high, row.high) << row.file;
  }
}

TEST(CtData, FindsTheLabelledVertebraAtItsPublishedCentre) {
  NEED_SHARED_DATA();
  ImportRequest request;
  request.from = kShared / "ct/verse-014/sub-verse014_ct.nii.gz";
  request.label = LabelRequest{kShared / "ct/verse-014/sub-verse014_seg-vert_msk.nii.gz", 22};
  const auto result = importVolume(request);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  const auto& inside = result->label->inside;
  EXPECT_EQ(std::count(inside.begin(), inside.end(), 1), 27601);

  // Centres of the bodies in voxels along P I R (third axis too, though the README says mm: in mm they would lie 20 mm
  // off the midline), so within the vertebra.
  const auto centroids = nlohmann::json::parse(readBytes(kShared / "ct/verse-014/sub-verse014_seg-vb_ctd.json"));
  bool found = false;
  for (const auto& point : centroids) {
    if (!point.contains("label") || point["label"] != 22) continue;
    found = true;
    const volume::Grid& grid = result->ct.grid;
    const int i = static_cast<int>(std::lround(point["X"].get<double>()));
    const int j = static_cast<int>(std::lround(point["Y"].get<double>()));
    const int k = static_cast<int>(std::lround(point["Z"].get<double>()));
    ASSERT_TRUE(grid.contains(i, j, k));
    EXPECT_EQ(inside[grid.index(i, j, k)], 1);
  }
  EXPECT_TRUE(found);
  request.label->value = 99;
  expectRefusal(importVolume(request), "values present: 20 21 22 23 24");
}

TEST(CtData, KeepsTheLabelOfAnIsotropicCrop) {
  NEED_SHARED_DATA();
  ImportRequest request;
  request.from = kShared / "ct/tptbox-l3/sub-ct_label-22_ct.nii.gz";
  request.label = LabelRequest{kShared / "ct/tptbox-l3/sub-ct_seg-vert_label-22_msk.nii.gz", 22};
  const auto result = importVolume(request);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_GT(std::count(result->label->inside.begin(), result->label->inside.end(), 1), 1000);
}

}  // namespace
}  // namespace spinaltap::importer
