// Malformed and awkward DICOM: each file and each series of the hostile folder has a line in a table here.
#include <cmath>

#include "server/import/child_process.h"
#include "server/import/protocol.h"
#include "server/import/sanitized.h"
#include "tests/server/import/shared_data.h"

namespace spinaltap::importer {
namespace {

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

}  // namespace
}  // namespace spinaltap::importer
