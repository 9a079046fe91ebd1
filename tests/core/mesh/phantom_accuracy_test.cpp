// The whole reconstruction, from the phantom's CT to its mesh, measured against the exact surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/base/random.h"
#include "core/mesh/polygonise.h"
#include "core/phantom/ct.h"
#include "core/rbf/rbf.h"
#include "core/segment/segment.h"
#include "core/surface/surface.h"
#include "core/volume/crop.h"
#include "tests/core/mesh/mesh_check.h"

namespace spinaltap {
namespace {

#if defined(__EMSCRIPTEN__) || defined(__SANITIZE_ADDRESS__)
constexpr int kCoarser = 2;  // the full stack is measured natively; here the point is that the code works at all
#else
constexpr int kCoarser = 1;
#endif
constexpr double kVoxel_mm = 0.5 * kCoarser;  // the longest side

struct Reconstructed {
  phantom::Phantom truth;
  Field field;
  mesh::TriangleMesh mesh;
  rbf::FitReport report;
};

Vec3 lowerOf(const Vec3& a, const Vec3& b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }

Result<Reconstructed> meshOf(const phantom::Phantom& truth, const surface::OrientedPoints& points) {
  auto samples = surface::makeSamples(points);
  if (!samples) return tl::unexpected(samples.error());
  auto fit = rbf::fit({std::move(samples->positions), std::move(samples->distances_mm)},
                      {.smoothing = rbf::kAutoSmoothing, .reduce_mm = surface::kFitTolerance_mm});
  if (!fit) return tl::unexpected(fit.error());
  const Field field = rbf::asField(std::move(fit->model), std::numeric_limits<double>::infinity());
  Vec3 low = points.positions_patient.front(), high = low;
  for (const Vec3& p : points.positions_patient) low = lowerOf(low, p), high = -lowerOf(-high, -p);
  const Vec3 margin = Vec3{1, 1, 1} * surface::kMeshMargin_mm;
  auto mesh = mesh::polygonise(field, points.positions_patient, {surface::kCell_mm, low - margin, high + margin});
  if (!mesh) return tl::unexpected(mesh.error());
  return Reconstructed{truth, field, std::move(*mesh), fit->report};
}

/// Segmented from a seed, as a user without a label would.
Result<Reconstructed> reconstruct(bool osteoporotic) {
  const auto truth = phantom::Phantom::make({.seed = 1, .osteoporotic = osteoporotic});
  const auto ct = phantom::sampleCt(truth, phantom::CtOptions::coarser(kCoarser));
  if (!ct) return tl::unexpected(ct.error());
  segment::GrowOptions grow;
  grow.seed_patient = truth.seedPoint();
  const auto label = segment::growFromSeed(*ct, grow);
  if (!label) return tl::unexpected(label.error());
  const auto points = surface::findBoundary(*ct, *label);
  if (!points) return tl::unexpected(points.error());
  return meshOf(truth, *points);
}

double rmsDistance(const phantom::Phantom& truth, const std::vector<Vec3>& points) {
  double squares = 0;
  for (const Vec3& p : points) squares += std::pow(truth.distanceToSurface(p), 2);
  return std::sqrt(squares / static_cast<double>(points.size()));
}

std::vector<Vec3> pointsOnTriangles(const mesh::TriangleMesh& mesh, std::size_t count, Random& random) {
  std::vector<Vec3> out;
  for (std::size_t n = 0; n < count; ++n) {
    const auto& t = mesh.triangles[random.below(mesh.triangles.size())];
    double a = random.unit(), b = random.unit();
    if (a + b > 1) a = 1 - a, b = 1 - b;
    out.push_back(mesh.vertices[t[0]] * (1 - a - b) + mesh.vertices[t[1]] * a + mesh.vertices[t[2]] * b);
  }
  return out;
}

struct Agreement {
  std::size_t asked = 0, wrong = 0;
};

/// Random points in the bone's box farther than one voxel from the true surface.
Agreement agreementOf(const Reconstructed& made, std::size_t count, Random& random) {
  const auto box = made.truth.bounds();
  const Vec3 low = box.low_patient - Vec3{4, 4, 4}, high = box.high_patient + Vec3{4, 4, 4};
  std::vector<Vec3> points;
  std::vector<double> distances;
  while (points.size() < count) {
    const Vec3 p{random.uniform(low.x, high.x), random.uniform(low.y, high.y), random.uniform(low.z, high.z)};
    double d = made.truth.signedDistance(p);
    // The slow exact distance only where the Lipschitz bound cannot tell.
    if (std::abs(d) <= kVoxel_mm * phantom::Phantom::kLipschitz) d = made.truth.distanceToSurface(p);
    if (std::abs(d) <= kVoxel_mm) continue;
    points.push_back(p), distances.push_back(d);
  }
  std::vector<double> fitted(points.size());
  made.field.values(points, fitted);
  Agreement out{count, 0};
  for (std::size_t i = 0; i < count; ++i) out.wrong += (fitted[i] < 0) != (distances[i] < 0) ? 1 : 0;
  return out;
}

void expectClose(const Reconstructed& made) {
  Random random(2002);
  std::vector<Vec3> vertices;
  for (std::size_t v = 0; v < made.mesh.vertices.size(); v += 20) vertices.push_back(made.mesh.vertices[v]);
  const double at_vertices = rmsDistance(made.truth, vertices);
  const double on_triangles = rmsDistance(made.truth, pointsOnTriangles(made.mesh, 2000, random));
  const Agreement agreement = agreementOf(made, 20'000, random);
  std::printf(
      "  voxel %.3f mm: vertices %.4f mm RMS, triangles %.4f mm RMS, %zu of %zu points on the wrong side, "
      "%zu centres for %zu samples, %zu triangles\n",
      kVoxel_mm, at_vertices, on_triangles, agreement.wrong, agreement.asked, made.report.centres, made.report.samples,
      made.mesh.triangles.size());
  // Half a voxel is what the issue asks for.
  EXPECT_LT(at_vertices, 0.5 * kVoxel_mm);
  EXPECT_LT(on_triangles, 0.5 * kVoxel_mm);
  EXPECT_LE(agreement.wrong, agreement.asked / 1000);
}

void expectOneVertebra(const Reconstructed& made) {
  const mesh::MeshCheck c = mesh::check(made.mesh);
  EXPECT_EQ(c.open_edges, 0U);
  EXPECT_EQ(c.repeated_edges, 0U);
  EXPECT_EQ(c.pinched_vertices, 0U);
  EXPECT_GE(c.least_angle_deg, mesh::kLeastAngle_deg);
  EXPECT_EQ(c.parts, 1U);
  EXPECT_EQ(c.euler, 0) << "a body with one tunnel, the canal";
}

TEST(PhantomAccuracy, TheMeshLiesWithinHalfAVoxelAndTheCanalIsOpen) {
  const auto made = reconstruct(false);
  ASSERT_TRUE(made.has_value()) << made.error().message;
  expectClose(*made);
  expectOneVertebra(*made);
}

TEST(PhantomAccuracy, TheThinShellOfOsteoporosisIsMetToo) {
  const auto made = reconstruct(true);
  ASSERT_TRUE(made.has_value()) << made.error().message;
  expectClose(*made);
  expectOneVertebra(*made);
}

}  // namespace
}  // namespace spinaltap
