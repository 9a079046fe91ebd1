// Real scans and hostile files. Each file of the hostile folder and each series has a line in a table here.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/import/child_process.h"
#include "server/import/protocol.h"
#include "server/import/sanitized.h"
#include "tests/server/import/made_files.h"

namespace spinaltap::importer {
namespace {

namespace fs = std::filesystem;

const fs::path kShared = SPINALTAP_SHARED_DATA;

#define NEED_SHARED_DATA() \
  if (!fs::exists(kShared)) GTEST_SKIP() << "no ../shared/data"

Result<ImportedVolume> importAs(const fs::path& from, bool single_slice) {
  ImportRequest request;
  request.from = from;
  request.allow_single_slice = single_slice;
  return importVolume(request);
}

/// One slice, to look at what a file decodes to.
Result<ImportedVolume> importSlice(const fs::path& file) { return importAs(file, true); }

/// Names that stand in the headers of these files.
void expectNoNames(const Error& error) {
  expectClean(error);
  EXPECT_EQ(error.message.find(kShared.string()), std::string::npos) << error.message;
  EXPECT_EQ(error.message.find('/'), std::string::npos) << error.message;
  for (const char* name : {"CompressedSamples", "Doe", "DOE", "Test^", "Anonymous", "<script", "rm -rf"}) {
    EXPECT_EQ(error.message.find(name), std::string::npos) << error.message;
  }
}

struct Expected {
  const char* file;
  const char* word;  ///< that the refusal holds; nullptr: loads
};

/// Every file must be in the table and every line of the table must be a file.
void checkTable(const fs::path& folder, std::span<const Expected> table, bool single_slice) {
  std::size_t found = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const auto row = std::find_if(table.begin(), table.end(), [&](const Expected& e) { return name == e.file; });
    ASSERT_NE(row, table.end()) << name << " is in no table";
    ++found;
    const auto result = importAs(entry.path(), single_slice);
    if (row->word == nullptr) {
      ASSERT_TRUE(result.has_value()) << name << ": " << result.error().message;
      continue;
    }
    ASSERT_FALSE(result.has_value()) << name << " loaded";
    EXPECT_NE(result.error().message.find(row->word), std::string::npos) << name << ": " << result.error().message;
    expectNoNames(result.error());
  }
  EXPECT_EQ(found, table.size());
}

// Those that load are valid, or wrong in what does not bear on geometry or HU: window, text, character sets, order of
// tags, group length, bytes behind the data set, depth of a private sequence, a second Rows (the first counts).
const Expected kMadeFiles[] = {
    {"00_valid-baseline.dcm", nullptr},
    {"01_empty.dcm", "empty file"},
    {"02_preamble-only.dcm", "not a DICOM file"},
    {"03_dicm-only.dcm", "03_dicm-only.dcm"},
    {"04_random-bytes.dcm", "not a DICOM file"},
    {"05_truncated-in-meta.dcm", "05_truncated-in-meta.dcm"},
    {"06_truncated-in-dataset.dcm", "06_truncated-in-dataset.dcm"},
    {"07_truncated-pixels.dcm", "truncated"},
    {"08_pixeldata-length-2gb.dcm", "08_pixeldata-length-2gb.dcm"},
    {"09_pixeldata-too-small.dcm", "pixel data truncated: 64 bytes"},
    {"10_pixeldata-too-big.dcm", "surplus pixel data"},
    {"11_no-pixeldata.dcm", "no pixel data"},
    {"12_unending-un.dcm", "12_unending-un.dcm"},
    {"13_header-length-overrun.dcm", "13_header-length-overrun.dcm"},
    {"14_rows-zero.dcm", "Rows or Columns"},
    {"15_rows-cols-65535.dcm", "65535 x 65535"},
    {"16_rows-missing.dcm", "Rows or Columns"},
    {"17_samples-4.dcm", "SamplesPerPixel"},
    {"18_bits-allocated-13.dcm", "BitsAllocated is 13"},
    {"19_bits-stored-20.dcm", "BitsStored"},
    {"20_high-bit-mismatch.dcm", "HighBit"},
    {"21_bits-allocated-32.dcm", "BitsAllocated is 32"},
    {"22_pixel-spacing-missing.dcm", "PixelSpacing"},
    {"23_pixel-spacing-zero.dcm", "PixelSpacing"},
    {"24_pixel-spacing-negative.dcm", "PixelSpacing"},
    {"25_pixel-spacing-nan-inf.dcm", "PixelSpacing"},
    {"26_pixel-spacing-one-value.dcm", "PixelSpacing"},
    {"27_pixel-spacing-text.dcm", "PixelSpacing"},
    {"28_iop-not-orthogonal.dcm", "orthogonal"},
    {"29_iop-zero.dcm", "orthogonal"},
    {"30_iop-five-values.dcm", "six numbers"},
    {"31_ipp-missing.dcm", "ImagePositionPatient"},
    {"32_ipp-huge.dcm", "ImagePositionPatient"},
    {"33_slope-zero.dcm", "RescaleSlope"},
    {"34_slope-text.dcm", "RescaleSlope"},
    {"35_rescale-missing.dcm", "RescaleSlope"},
    {"36_slope-huge.dcm", "RescaleSlope"},
    {"37_frames-two-billion.dcm", "2000000000 frames"},
    {"38_frames-negative.dcm", "NumberOfFrames"},
    {"39_window-width-zero.dcm", nullptr},
    {"40_ts-implicit-but-explicit.dcm", "40_ts-implicit-but-explicit.dcm"},
    {"41_ts-big-endian-but-little.dcm", "41_ts-big-endian-but-little.dcm"},
    {"42_ts-unknown.dcm", "transfer syntax"},
    {"43_ts-missing.dcm", "43_ts-missing.dcm"},
    {"44_j2k-declared-raw-inside.dcm", "compressed pixel data"},
    {"45_jpeg-65535x65535.dcm", "compressed pixel data"},
    {"46_jpeg-no-eoi.dcm", "compressed pixel data"},
    {"47_j2k-huge-siz.dcm", "compressed pixel data"},
    {"48_rle-bad-segments.dcm", "compressed pixel data"},
    {"49_rle-overrun.dcm", "compressed pixel data"},
    {"50_encapsulated-no-delimiter.dcm", "50_encapsulated-no-delimiter.dcm"},
    {"51_encapsulated-bad-item-tag.dcm", "51_encapsulated-bad-item-tag.dcm"},
    {"52_encapsulated-item-4gb.dcm", "52_encapsulated-item-4gb.dcm"},
    {"53_bot-bad-offsets.dcm", "frames"},
    {"54_sequence-depth-5000.dcm", nullptr},
    {"55_sequence-unclosed.dcm", "55_sequence-unclosed.dcm"},
    {"56_sequence-item-past-parent.dcm", "56_sequence-item-past-parent.dcm"},
    {"57_deflate-bomb-256mb.dcm", "inflates to more"},
    {"58_deflate-truncated.dcm", "deflated data"},
    {"59_duplicate-rows.dcm", nullptr},
    {"60_tags-out-of-order.dcm", nullptr},
    {"61_meta-group-length-wrong.dcm", nullptr},
    {"62_charset-unknown.dcm", nullptr},
    {"63_strings-hostile.dcm", nullptr},
    {"64_text-60kb.dcm", nullptr},
    {"65_uid-empty.dcm", nullptr},
    {"66_modality-mr.dcm", "not a CT image"},
    {"67_monochrome1.dcm", "MONOCHROME1"},
    {"68_palette-no-lut.dcm", "colour"},
    {"69_preamble-mz.dcm", nullptr},
    {"70_text-file.dcm", "not a DICOM file"},
    {"71_png-named.dcm", "not a DICOM file"},
    {"72_trailing-garbage.dcm", nullptr},
    {"73_icpt-overflow-int16.dcm", "do not fit"},
};

TEST(HostileData, EndsEveryMadeFileAsItsTableSays) {
  NEED_SHARED_DATA();
  checkTable(kShared / "hostile/made-files", kMadeFiles, true);
}

TEST(HostileData, GivesTheMadeFilesThatLoadTheHuOfTheControl) {
  NEED_SHARED_DATA();
  const fs::path folder = kShared / "hostile/made-files";
  const auto control = importSlice(folder / "00_valid-baseline.dcm");
  ASSERT_TRUE(control.has_value());
  for (const Expected& row : kMadeFiles) {
    if (row.word != nullptr) continue;
    const auto result = importSlice(folder / row.file);
    ASSERT_TRUE(result.has_value());
    EXPECT_EQ(result->ct.hu, control->ct.hu) << row.file;
    EXPECT_EQ(result->ct.grid, control->ct.grid) << row.file;
  }
}

const Expected kCollected[] = {
    {"3gb-bulk-data-truncated", "3gb-bulk-data-truncated"},
    {"DICOMDIR-empty.dcm", "DICOMDIR index"},
    {"DICOMDIR-nooffset", "DICOMDIR-nooffset"},
    {"DICOMDIR-nopatient", "DICOMDIR index"},
    {"ExplVR_BigEndNoMeta.dcm", "radiotherapy"},
    {"ExplVR_LitEndNoMeta.dcm", "radiotherapy"},
    {"JPEG2000-embedded-sequence-delimiter.dcm", "secondary capture"},
    {"MR_truncated.dcm", "MR_truncated.dcm"},
    {"UN_sequence.dcm", "not a CT image"},
    {"badVR.dcm", "radiotherapy"},
    {"bad_sequence.dcm", nullptr},  // sequences as UN of defined length; the image itself is a sound CT slice
    {"emri_small_jpeg_2k_lossless_too_short.dcm", "MR image"},
    {"explicit_VR-UN.dcm", nullptr},  // all elements as UN; a sound CT slice
    {"fo-dicom_GH1301.dcm", "secondary capture"},
    {"fo-dicom_GH220.dcm", "not a CT image"},
    {"fo-dicom_GH223.dcm", "not a CT image"},
    {"fo-dicom_GH487.dcm", "not a CT image"},
    {"fo-dicom_Issue1097_FailToOpenDeflatedFileWithSQ.dcm", "not a CT image"},
    {"meta_missing_tsyntax.dcm", "meta_missing_tsyntax.dcm"},
    {"nested_priv_SQ.dcm", "not a CT image"},
    {"no-pixel-spacing.dcm", "ultrasound"},
    {"no_meta_group_length.dcm", "radiotherapy"},
    {"no_preamble_dicm_in_data", "no_preamble_dicm_in_data"},
    {"priv_SQ.dcm", "MR image"},
    {"reportsi_with_empty_number_tags.dcm", "structured report"},
    {"rtplan_truncated.dcm", "truncated"},
};

TEST(HostileData, EndsEveryCollectedFileAsItsTableSays) {
  NEED_SHARED_DATA();
  checkTable(kShared / "hostile/collected", kCollected, true);
}

TEST(HostileData, SpendsNoMemoryOnWhatAFileOnlyDeclares) {
  NEED_SHARED_DATA();
  if (SPINALTAP_SANITIZED != 0) GTEST_SKIP() << "AddressSanitizer's own memory is in the figure";
  for (const char* file : {"made-files/08_pixeldata-length-2gb.dcm", "made-files/15_rows-cols-65535.dcm",
                           "made-files/37_frames-two-billion.dcm", "made-files/45_jpeg-65535x65535.dcm",
                           "made-files/47_j2k-huge-siz.dcm", "made-files/52_encapsulated-item-4gb.dcm",
                           "made-files/57_deflate-bomb-256mb.dcm", "collected/3gb-bulk-data-truncated"}) {
    ImportRequest request;
    request.from = kShared / "hostile" / file;
    request.allow_single_slice = true;
    ChildStreams streams;
    streams.output = [](std::span<const std::byte>) { return true; };
    const auto end = runChild(defaultChildProgram(), {}, encodeRequest(request), request.limits.wall_time, streams);
    ASSERT_TRUE(end.has_value());
    // The sandbox gives 192 MiB, and eight times the input (at most 0.25 MB here), beyond program and libraries (64
    // MiB).
    EXPECT_LT(end->max_resident_kib, (192 + 64 + 2) * 1024) << file;
  }
}

const Expected kSeries[] = {
    {"s00_valid-baseline", nullptr},
    {"s01_missing-slice", "1 missing slice(s) between slice03.dcm and slice05.dcm"},
    {"s02_duplicate-position", "duplicate"},
    {"s03_mixed-pixel-spacing", "slice04.dcm: its pixel spacing"},
    {"s04_mixed-size", "slice05.dcm: its size"},
    {"s05_mixed-orientation", "slice04.dcm: its orientation"},
    {"s06_two-series", "holds 2 of them, choose one"},
    {"s07_gantry-tilt", "15 degrees off"},
    {"s08_reversed-instance-numbers", nullptr},
    {"s09_single-slice", "single slice"},
    {"s10_irregular-spacing", "irregular slice spacing"},
    {"s11_all-same-position", "duplicate"},
    {"s12_rescale-per-slice", nullptr},
    {"s13_mixed-frame-of-reference", "slice04.dcm: its frame of reference"},
    {"s14_one-truncated-slice", "slice03.dcm: truncated"},
    {"s15_mixed-transfer-syntax", nullptr},
    {"s16_other-files-in-folder", nullptr},
    {"s17_position-noise", nullptr},
    {"s18_position-jitter", "irregular slice spacing"},
    {"s19_oblique", nullptr},
    {"s20_sagittal", nullptr},
    {"s21_overlapping-thickness", nullptr},
    {"s22_same-sop-uid", "SOPInstanceUID"},
    {"s23_descending-z", nullptr},
    {"s24_no-thickness-no-location", nullptr},
    {"s25_lateral-drift", "sheared"},
};

TEST(HostileData, EndsEverySeriesAsItsTableSays) {
  NEED_SHARED_DATA();
  checkTable(kShared / "hostile/made-series", kSeries, false);
}

/// In row 1 slice k has k + 1 bright pixels from column 1 on (the README of the data says k + 2; the bytes do not).
int brightPixels(const volume::CtVolume& ct, int k) {
  int count = 0;
  for (int i = 0; i < ct.grid.dims[0]; ++i) count += ct.hu[ct.grid.index(i, 1, k)] == 1500 ? 1 : 0;
  return count;
}

TEST(HostileData, GivesEveryValidSeriesTheSameHuAsTheControl) {
  NEED_SHARED_DATA();
  const fs::path folder = kShared / "hostile/made-series";
  const auto control = importFrom(folder / "s00_valid-baseline");
  ASSERT_TRUE(control.has_value());
  for (int k = 0; k < 8; ++k) EXPECT_EQ(brightPixels(control->ct, k), k + 1);
  for (const Expected& row : kSeries) {
    if (row.word != nullptr) continue;
    const auto result = importFrom(folder / row.file);
    ASSERT_TRUE(result.has_value());
    const std::string name = row.file;
    // x rising in s20 and z falling in s23: the far slice comes first along row x column.
    const bool reversed = brightPixels(result->ct, 0) != 1;
    EXPECT_EQ(reversed, name == "s20_sagittal" || name == "s23_descending-z") << name;
    for (int k = 0; k < 8; ++k) {
      const int from = reversed ? 7 - k : k;
      const auto slice = [](const volume::CtVolume& ct, int at) {
        return std::vector<std::int16_t>(ct.hu.begin() + at * 1024, ct.hu.begin() + (at + 1) * 1024);
      };
      EXPECT_EQ(slice(result->ct, k), slice(control->ct, from)) << name << " slice " << k;
    }
    if (!reversed && name != "s19_oblique" && name != "s17_position-noise") {
      EXPECT_EQ(result->ct.grid, control->ct.grid) << name;
    }
  }
}

TEST(HostileData, PlacesTheObliqueAndTheSagittalSeriesInThePatient) {
  NEED_SHARED_DATA();
  const auto oblique = importFrom(kShared / "hostile/made-series/s19_oblique");
  ASSERT_TRUE(oblique.has_value());
  const double angle = 15 * 3.14159265358979323846 / 180;
  // The header prints six decimals.
  EXPECT_NEAR(norm(oblique->ct.grid.direction.col_z - Vec3{0, -std::sin(angle), std::cos(angle)}), 0, 1e-5);
  EXPECT_NEAR(oblique->ct.grid.spacing_mm.z, 2, 1e-4);
  const auto sagittal = importFrom(kShared / "hostile/made-series/s20_sagittal");
  ASSERT_TRUE(sagittal.has_value());
  EXPECT_EQ(sagittal->ct.grid.direction.col_x, (Vec3{0, 1, 0}));
  EXPECT_EQ(sagittal->ct.grid.direction.col_y, (Vec3{0, 0, -1}));
  EXPECT_EQ(sagittal->ct.grid.direction.col_z, (Vec3{-1, 0, 0}));
}

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
