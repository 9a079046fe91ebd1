// NIfTI files made in the test: data types, byte order, orientation, labels, and each reason for a refusal.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "tests/server/import/made_files.h"

namespace spinaltap::importer {
namespace {

int valueAt(int i, int j, int k) { return i + 10 * j + 50 * k; }

MadeNifti made() {
  MadeNifti file;
  file.fill<std::int16_t>(valueAt);
  return file;
}

Result<ImportedVolume> importBytes(const std::string& bytes) {
  const Scratch scratch;
  return importFrom(scratch.write("ct.nii", bytes));
}

/// The value that the file has at a place in the patient: found by the grid alone, so that any reversal is seen.
void expectValuesInPlace(const ImportedVolume& volume, const MadeNifti& file) {
  const volume::Grid& grid = volume.ct.grid;
  const auto& s = file.srow;
  for (int k = 0; k < file.dims[2]; ++k) {
    for (int j = 0; j < file.dims[1]; ++j) {
      for (int i = 0; i < file.dims[0]; ++i) {
        const auto ras = [&](std::size_t r) {
          return static_cast<double>(s[4 * r]) * i + static_cast<double>(s[4 * r + 1]) * j +
                 static_cast<double>(s[4 * r + 2]) * k + static_cast<double>(s[4 * r + 3]);
        };
        const Vec3 v = grid.toVoxel({-ras(0), -ras(1), ras(2)});
        const int x = static_cast<int>(std::lround(v.x)), y = static_cast<int>(std::lround(v.y)),
                  z = static_cast<int>(std::lround(v.z));
        ASSERT_TRUE(grid.contains(x, y, z));
        // srow is single precision: 7 digits of tens of mm.
        ASSERT_LT(norm(v - Vec3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}), 1e-4);
        ASSERT_EQ(volume.ct.hu[grid.index(x, y, z)], valueAt(i, j, k)) << i << " " << j << " " << k;
      }
    }
  }
}

void expectRightHanded(const volume::Grid& grid) {
  EXPECT_NEAR(dot(cross(grid.direction.col_x, grid.direction.col_y), grid.direction.col_z), 1, 1e-9);
}

template <class T>
void expectType(int datatype) {
  MadeNifti file = made();
  file.datatype = datatype;
  file.bits = 8 * static_cast<int>(sizeof(T));
  file.fill<T>(valueAt);
  const auto result = importBytes(file.bytes());
  ASSERT_TRUE(result.has_value()) << datatype << ": " << result.error().message;
  expectValuesInPlace(*result, file);
}

TEST(NiftiImport, ReadsEveryRealDataType) {
  expectType<std::uint8_t>(2);
  expectType<std::int16_t>(4);
  expectType<std::int32_t>(8);
  expectType<float>(16);
  expectType<double>(64);
  expectType<std::int8_t>(256);
  expectType<std::uint16_t>(512);
  expectType<std::uint32_t>(768);
  expectType<std::int64_t>(1024);
  expectType<std::uint64_t>(1280);
}

TEST(NiftiImport, PutsEveryVoxelInPlaceForAllOrdersAndSensesOfTheAxes) {
  std::array<std::size_t, 3> order{0, 1, 2};
  do {
    for (unsigned flips = 0; flips < 8; ++flips) {
      MadeNifti file = made();
      file.srow.fill(0);
      const std::array<float, 3> spacing{2, 3, 4};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        file.srow[4 * order[axis] + axis] = (flips >> axis & 1U) != 0 ? -spacing[axis] : spacing[axis];
        file.srow[4 * axis + 3] = static_cast<float>(10 + 5 * axis);
      }
      const auto result = importBytes(file.bytes());
      ASSERT_TRUE(result.has_value()) << result.error().message;
      EXPECT_EQ(result->ct.grid.spacing_mm, (Vec3{2, 3, 4}));
      expectRightHanded(result->ct.grid);
      expectValuesInPlace(*result, file);
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(NiftiImport, FallsBackToTheQuaternionWhenThereIsNoSform) {
  MadeNifti file = made();
  file.sform = 0;
  file.qform = 1;
  // A quarter turn about z and a third axis that runs backwards: x -> y, y -> -x, z -> -z.
  const float half = std::sqrt(0.5F);
  file.quatern = {0, 0, half};
  file.pixdim[0] = -1;
  file.offset = {1, 2, 3};
  const auto result = importBytes(file.bytes());
  ASSERT_TRUE(result.has_value()) << result.error().message;
  file.srow = {0, -3, 0, 1, 2, 0, 0, 2, 0, 0, -4, 3};
  expectValuesInPlace(*result, file);
}

TEST(NiftiImport, PrefersTheSformOverTheQuaternion) {
  MadeNifti file = made();
  file.qform = 1;
  file.offset = {100, 100, 100};
  const auto result = importBytes(file.bytes());
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectValuesInPlace(*result, file);
  ASSERT_EQ(result->notes.size(), 1u);
  EXPECT_NE(result->notes[0].find("disagree"), std::string::npos);
}

TEST(NiftiImport, AppliesSlopeAndIntercept) {
  MadeNifti file = made();
  file.slope = 0.5F;
  file.intercept = -3;
  file.fill<std::int16_t>([](int i, int j, int k) { return 2 * (valueAt(i, j, k) + 3); });
  const auto result = importBytes(file.bytes());
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectValuesInPlace(*result, file);
}

TEST(NiftiImport, ReadsGzippedFilesInSeveralMembers) {
  const MadeNifti file = made();
  const std::string bytes = file.bytes();
  for (const std::string& packed : {gzipped(bytes), gzipped(bytes.substr(0, 360)) + gzipped(bytes.substr(360))}) {
    const auto result = importBytes(packed);
    ASSERT_TRUE(result.has_value()) << result.error().message;
    expectValuesInPlace(*result, file);
  }
}

TEST(NiftiImport, ReadsBigEndianFiles) {
  const MadeNifti file = made();
  std::string bytes = file.bytes();
  const auto swap = [&](std::size_t at, std::size_t width, std::size_t count) {
    for (std::size_t n = 0; n < count; ++n) {
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at + n * width),
                   bytes.begin() + static_cast<std::ptrdiff_t>(at + (n + 1) * width));
    }
  };
  swap(0, 4, 1);
  swap(40, 2, 8);
  swap(70, 2, 2);
  swap(76, 4, 8);
  swap(108, 4, 3);
  swap(252, 2, 2);
  swap(256, 4, 18);
  swap(352, 2, file.voxels.size() / 2);
  const auto result = importBytes(bytes);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectValuesInPlace(*result, file);
}

TEST(NiftiImport, ReadsVersionTwo) {
  const MadeNifti file = made();
  std::string h(544, '\0');
  const auto put = [&](std::size_t at, const auto& value) { std::memcpy(h.data() + at, &value, sizeof value); };
  put(0, std::int32_t{540});
  std::memcpy(h.data() + 4, "n+2\0\r\n\032\n", 8);
  put(12, std::int16_t{4});
  put(14, std::int16_t{16});
  const std::array<std::int64_t, 8> dim{3, 4, 3, 2, 1, 1, 1, 1};
  put(16, dim);
  put(168, std::int64_t{544});
  put(348, std::int32_t{1});
  for (std::size_t n = 0; n < 12; ++n) put(400 + 8 * n, static_cast<double>(file.srow[n]));
  put(500, std::int32_t{2});
  const auto result = importBytes(h + file.voxels);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  expectValuesInPlace(*result, file);
}

TEST(NiftiImport, TakesMicronsAndMetresAsWhatTheyAre) {
  MadeNifti file = made();
  file.units = 3;
  for (float& v : file.srow) v *= 1000;
  const auto result = importBytes(file.bytes());
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_NEAR(result->ct.grid.spacing_mm.z, 4, 1e-6);
}

struct Refusal {
  const char* name;
  const char* word;
  void (*change)(MadeNifti& file);
};
class NiftiRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(NiftiRefusal, SaysWhatWasWrong) {
  MadeNifti file = made();
  GetParam().change(file);
  const std::string bytes = file.bytes();
  expectRefusal(importBytes(bytes), GetParam().word);
  expectRefusal(importBytes(gzipped(bytes)), GetParam().word);
}

void toFloats(MadeNifti& file, float odd) {
  file.datatype = 16;
  file.bits = 32;
  file.fill<float>([odd](int i, int, int k) { return i == 1 && k == 1 ? odd : 0.0F; });
}

const Refusal kRefusals[] = {
    {"FourDimensions", "more than three", [](MadeNifti& f) { f.dimensions = 4, f.fourth = 2; }},
    {"TwoDimensions", "fewer than three", [](MadeNifti& f) { f.dimensions = 2; }},
    {"OneSlice", "single slice", [](MadeNifti& f) { f.dims[2] = 1; }},
    {"NegativeDimension", "not positive", [](MadeNifti& f) { f.dims[1] = -3; }},
    {"HugeDimensions", "over the limit", [](MadeNifti& f) { f.dims = {32767, 32767, 32767}; }},
    {"LargerThanItsVoxels", "truncated", [](MadeNifti& f) { f.dims = {400, 300, 200}; }},
    {"LastVoxelMissing", "truncated", [](MadeNifti& f) { f.voxels.pop_back(); }},
    {"ColourType", "no real number", [](MadeNifti& f) { f.datatype = 128, f.bits = 24; }},
    {"ContradictingBits", "bitpix", [](MadeNifti& f) { f.bits = 8; }},
    {"NoOrientation", "left and right are unknown", [](MadeNifti& f) { f.sform = 0; }},
    {"Sheared", "not orthogonal", [](MadeNifti& f) { f.srow[1] = 0.01F; }},
    {"ZeroStep", "voxel size", [](MadeNifti& f) { f.srow[5] = 0; }},
    {"NanStep", "voxel size", [](MadeNifti& f) { f.srow[5] = std::numeric_limits<float>::quiet_NaN(); }},
    {"InfiniteOrigin", "origin", [](MadeNifti& f) { f.srow[3] = std::numeric_limits<float>::infinity(); }},
    {"NanVoxel", "not a finite number", [](MadeNifti& f) { toFloats(f, std::numeric_limits<float>::quiet_NaN()); }},
    {"InfiniteVoxel", "not a finite number", [](MadeNifti& f) { toFloats(f, std::numeric_limits<float>::infinity()); }},
    {"TooDenseVoxel", "do not fit", [](MadeNifti& f) { toFloats(f, 40000); }},
    {"OffsetInsideTheHeader", "vox_offset", [](MadeNifti& f) { f.vox_offset = 100; }},
    {"OffsetNan", "vox_offset", [](MadeNifti& f) { f.vox_offset = std::numeric_limits<float>::quiet_NaN(); }},
    {"HeaderOfAPair", "pair", [](MadeNifti& f) { f.magic = std::string("ni1\0", 4); }},
    {"OtherUnit", "unit", [](MadeNifti& f) { f.units = 7; }},
};

INSTANTIATE_TEST_SUITE_P(Made, NiftiRefusal, testing::ValuesIn(kRefusals),
                         [](const testing::TestParamInfo<Refusal>& param) { return std::string(param.param.name); });

TEST(NiftiImport, RefusesAFileCutAtAnyByte) {
  const std::string plain = made().bytes(), packed = gzipped(plain);
  for (std::size_t size = 1; size < plain.size(); size += 23) {
    const auto result = importBytes(plain.substr(0, size));
    ASSERT_FALSE(result.has_value()) << size;
    expectClean(result.error());
  }
  // The last eight bytes are the checksum and length, read only by those who read on.
  for (std::size_t size = 1; size + 8 < packed.size(); size += 5) {
    const auto result = importBytes(packed.substr(0, size));
    ASSERT_FALSE(result.has_value()) << size;
    expectClean(result.error());
  }
}

MadeNifti madeLabel() {
  MadeNifti label = made();
  label.datatype = 2;
  label.bits = 8;
  label.fill<std::uint8_t>([](int i, int j, int k) { return i == 1 && j == 2 ? 20 + k : 0; });
  return label;
}

Result<ImportedVolume> importLabelled(const MadeNifti& ct, const MadeNifti& label, int value) {
  const Scratch scratch;
  ImportRequest request;
  request.from = scratch.write("ct.nii.gz", gzipped(ct.bytes()));
  request.label = LabelRequest{scratch.write("label.nii.gz", gzipped(label.bytes())), value};
  return importVolume(request);
}

/// The one voxel that is inside must be the CT's voxel (1, 2, 1) of the file, whose HU tells it from all others.
void expectOneVoxel(const Result<ImportedVolume>& result) {
  ASSERT_TRUE(result.has_value()) << result.error().message;
  ASSERT_TRUE(result->label.has_value());
  EXPECT_EQ(result->label->grid, result->ct.grid);
  ASSERT_EQ(result->label->inside.size(), result->ct.hu.size());
  for (std::size_t v = 0; v < result->ct.hu.size(); ++v) {
    EXPECT_EQ(result->label->inside[v], result->ct.hu[v] == valueAt(1, 2, 1) ? 1 : 0);
  }
}

TEST(LabelImport, KeepsOneValueOnTheGridOfTheCt) { expectOneVoxel(importLabelled(made(), madeLabel(), 21)); }

TEST(LabelImport, FollowsTheCtWhenItsAxesAreReversed) {
  MadeNifti ct = made();
  ct.srow[0] = 2;  // left-handed in the patient: the importer reverses i
  MadeNifti label = madeLabel();
  label.srow[0] = 2;
  expectOneVoxel(importLabelled(ct, label, 21));
}

TEST(LabelImport, AcceptsTheSameVoxelsInAnotherOrderOfAxes) {
  // The label's axes are the CT's j (backwards), k and i.
  MadeNifti label = madeLabel();
  label.dims = {3, 2, 4};
  label.fill<std::uint8_t>([](int a, int b, int c) { return c == 1 && 2 - a == 2 ? 20 + b : 0; });
  label.srow = {0, 0, -2, 10, -3, 0, 0, 26, 0, 4, 0, 30};
  expectOneVoxel(importLabelled(made(), label, 21));
}

TEST(LabelImport, ListsTheValuesThereAreWhenTheOneAskedForIsNot) {
  const auto result = importLabelled(made(), madeLabel(), 5);
  expectRefusal(result, "values present: 20 21");
  EXPECT_EQ(result.error().code, ErrorCode::NotFound);
  expectRefusal(importLabelled(made(), madeLabel(), 0), "label value");
}

TEST(LabelImport, RefusesALabelOnOtherVoxels) {
  MadeNifti shifted = madeLabel();
  shifted.srow[3] += 0.2F;
  expectRefusal(importLabelled(made(), shifted, 21), "elsewhere");
  MadeNifti smaller = madeLabel();
  smaller.dims[0] = 3;
  expectRefusal(importLabelled(made(), smaller, 21), "other dimensions");
  MadeNifti coarser = madeLabel();
  coarser.srow[10] = 4.2F;
  expectRefusal(importLabelled(made(), coarser, 21), "elsewhere");
}

TEST(LabelImport, RefusesAnImageThatIsNoLabel) {
  MadeNifti label = madeLabel();
  label.datatype = 16;
  label.bits = 32;
  label.fill<float>([](int i, int, int) { return 0.25F * static_cast<float>(i); });
  expectRefusal(importLabelled(made(), label, 1), "no whole numbers");
}

TEST(LabelImport, LiesOnADicomSeriesToo) {
  const Scratch scratch;
  writeSeries(scratch, 5, [](int, DicomElements&) {});
  MadeNifti label;
  label.dims = {kColumns, kRows, 5};
  label.datatype = 2;
  label.bits = 8;
  // RAS of the DICOM grid: x and y change sign.
  label.srow = {-0.5F, 0, 0, 10, 0, -0.75F, 0, -20, 0, 0, 2, 30};
  label.fill<std::uint8_t>([](int i, int j, int k) { return i == 3 && j == 4 && k == 2 ? 7 : 0; });
  const Scratch elsewhere;
  ImportRequest request;
  request.from = scratch.path();
  request.label = LabelRequest{elsewhere.write("label.nii", label.bytes()), 7};
  const auto result = importVolume(request);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  const auto& inside = result->label->inside;
  EXPECT_EQ(std::count(inside.begin(), inside.end(), 1), 1);
  EXPECT_EQ(inside[result->ct.grid.index(3, 4, 2)], 1);
}

}  // namespace
}  // namespace spinaltap::importer
