// From the files of real scans to a closed surface. Clearances are read from the fitted surface: there is no truth
// here, so the tests ask for what must be so: a path through the pedicle lies in bone, the canal beside it does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "core/mesh/parts.h"
#include "core/mesh/polygonise.h"
#include "core/rbf/rbf.h"
#include "core/segment/isolate.h"
#include "core/segment/segment.h"
#include "core/surface/surface.h"
#include "server/import/import.h"
#include "tests/core/mesh/mesh_check.h"

namespace spinaltap {
namespace {

namespace fs = std::filesystem;
const fs::path kCt = fs::path(SPINALTAP_SHARED_DATA) / "ct";

#define NEED_SHARED_DATA() \
  if (!fs::exists(kCt)) GTEST_SKIP() << "the folder of shared data is absent"

struct Made {
  Field field;
  mesh::TriangleMesh bone;
  double label_mm3 = 0;
};

Result<Made> reconstruct(const volume::CtVolume& ct, const volume::LabelVolume& label) {
  surface::BoundaryOptions boundary;
  boundary.spacing_mm = surface::sampleSpacingFor(ct.grid.spacing_mm);
  const auto points = surface::findBoundary(ct, label, boundary);
  if (!points) return tl::unexpected(points.error());
  auto samples = surface::makeSamples(*points);
  if (!samples) return tl::unexpected(samples.error());
  auto fit = rbf::fit({std::move(samples->positions), std::move(samples->distances_mm)},
                      {.smoothing = rbf::kAutoSmoothing, .reduce_mm = surface::kFitTolerance_mm});
  if (!fit) return tl::unexpected(fit.error());
  std::printf("  %zu points (%zu from the CT), %zu centres, residual %.2f mm RMS\n", points->normals.size(),
              points->from_ct, fit->report.centres, fit->report.residual_rms_mm);
  Made made;
  made.field = rbf::asField(std::move(fit->model), std::numeric_limits<double>::infinity());
  Vec3 low = points->positions_patient.front(), high = low;
  for (const Vec3& p : points->positions_patient) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3 margin = Vec3{1, 1, 1} * surface::kMeshMargin_mm;
  const auto mesh = mesh::polygonise(made.field, points->positions_patient, {1.0, low - margin, high + margin});
  if (!mesh) return tl::unexpected(mesh.error());
  made.bone = mesh::largestPart(*mesh);
  const Vec3& s = ct.grid.spacing_mm;
  made.label_mm3 = static_cast<double>(std::count(label.inside.begin(), label.inside.end(), 1)) * s.x * s.y * s.z;
  return made;
}

Result<importer::ImportedVolume> import(const fs::path& from, const fs::path& label = {}, int value = 0) {
  importer::ImportRequest request;
  request.from = kCt / from;
  if (!label.empty()) request.label = importer::LabelRequest{kCt / label, value};
  return importer::importVolume(request);
}

double at(const Field& field, const Vec3& place) {
  double value = 0;
  field.values({&place, 1}, {&value, 1});
  return value;
}

/// A 3 mm bit on this path stays in bone from 5 mm below the surface (the entry is an oblique slope) to the target.
void expectPathInBone(const Field& field, const Vec3& entry, const Vec3& target) {
  const double length = norm(target - entry);
  EXPECT_NEAR(at(field, entry), 0, 1.0);
  for (double depth = 5; depth <= length; depth += 0.5) {
    EXPECT_LT(at(field, entry + (target - entry) * (depth / length)), -1.5) << "at " << depth << " mm";
  }
}

void expectClosedBone(const Made& made) {
  const mesh::MeshCheck c = mesh::check(made.bone);
  EXPECT_EQ(c.open_edges, 0U);
  EXPECT_EQ(c.repeated_edges, 0U);
  EXPECT_EQ(c.pinched_vertices, 0U);
  EXPECT_GE(c.least_angle_deg, mesh::kLeastAngle_deg);
  // Labels are drawn a little outside the half-way edge, by up to half a voxel all round.
  EXPECT_GT(c.volume_mm3, 0.75 * made.label_mm3);
  EXPECT_LT(c.volume_mm3, 1.1 * made.label_mm3);
}

TEST(RealCt, ALabelledLumbarVertebraBecomesAClosedSurface) {
  NEED_SHARED_DATA();
  const auto scan = import("verse-014/sub-verse014_ct.nii.gz", "verse-014/sub-verse014_seg-vert_msk.nii.gz", 22);
  ASSERT_TRUE(scan.has_value()) << scan.error().message;
  const auto label = segment::largestIsland(*scan->label);
  ASSERT_TRUE(label.has_value());
  const auto made = reconstruct(scan->ct, *label);
  ASSERT_TRUE(made.has_value()) << made.error().message;
  expectClosedBone(*made);
  expectPathInBone(made->field, {-41.7, 200.1, -129.0}, {-37.4, 172.0, -122.2});  // the patient's right
  expectPathInBone(made->field, {-5.9, 198.2, -132.5}, {-13.2, 172.0, -123.5});   // left
  EXPECT_GT(at(made->field, {-22, 195, -124}), 2) << "the canal";
}

TEST(RealCt, AScannersOwnSlicesAreSegmentedFromOneClick) {
  NEED_SHARED_DATA();
  const auto scan = import("pancreas-cb-001/dicom");
  ASSERT_TRUE(scan.has_value()) << scan.error().message;
  segment::IsolateOptions click;
  click.seed_patient = {6, 110, 220};  // the body of L3
  const auto found = segment::isolate(scan->ct, click);
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_EQ(found->neighbours.size(), 2U);
  const auto* label = &found->label;
  const auto made = reconstruct(scan->ct, *label);
  ASSERT_TRUE(made.has_value()) << made.error().message;
  expectClosedBone(*made);
  expectPathInBone(made->field, {-17.1, 144.2, 224.6}, {-0.2, 112.0, 225.0});
  expectPathInBone(made->field, {34.3, 139.3, 223.1}, {14.6, 112.0, 222.9});
  EXPECT_GT(at(made->field, {7.7, 132.9, 226}), 2) << "the canal";
}

TEST(RealCt, AnIsotropicVertebraWithSoftTissueHasOneTunnel) {
  NEED_SHARED_DATA();
  const auto scan = import("tptbox-l3/sub-ct_label-22_ct.nii.gz", "tptbox-l3/sub-ct_seg-vert_label-22_msk.nii.gz", 22);
  ASSERT_TRUE(scan.has_value()) << scan.error().message;
  const auto made = reconstruct(scan->ct, *segment::largestIsland(*scan->label));
  ASSERT_TRUE(made.has_value()) << made.error().message;
  expectClosedBone(*made);
  EXPECT_EQ(mesh::check(made->bone).euler, 0) << "the canal, and nothing else";
}

TEST(RealCt, ABodyCutOutOfItsBoneKeepsTheLabelsOutline) {
  NEED_SHARED_DATA();
  const auto scan = import("spinefe-l2/sub-verse004_0000_vertebra_21_im_reoriented.nii.gz",
                           "spinefe-l2/sub-verse004_0000_vertebra_21_seg_reoriented.nii.gz", 1);
  ASSERT_TRUE(scan.has_value()) << scan.error().message;
  const auto made = reconstruct(scan->ct, *segment::largestIsland(*scan->label));
  ASSERT_TRUE(made.has_value()) << made.error().message;
  // Label 1 is the core within the shell: there is hardly an edge in the CT, and the shell beyond must not be taken for
  // it.
  expectClosedBone(*made);
}

}  // namespace
}  // namespace spinaltap
