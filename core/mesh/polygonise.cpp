#include "core/mesh/polygonise.h"

#include <algorithm>
#include <cmath>

#include "core/mesh/crossings.h"
#include "core/mesh/follow.h"
#include "core/mesh/pinches.h"
#include "core/mesh/stuff.h"

namespace spinaltap::mesh {
namespace {

constexpr int kMostCubes = kMostHalves / 2;
/// Cubes of two nodes (a corner and a middle) are this much wider than cubes of one: the cube root of two.
constexpr double kCubePerCell = 1.2599210498948732;

Result<Lattice> latticeOf(const PolygoniseOptions& options) {
  const Vec3 &low = options.low_patient, &high = options.high_patient;
  const double cube = options.cell_mm * kCubePerCell;
  if (!isFinite(low) || !isFinite(high) || !std::isfinite(cube)) {
    return fail(ErrorCode::NotFinite, "polygonise box or cell is not finite");
  }
  const Vec3 size = high - low;
  if (!(cube > 0)) return fail(ErrorCode::InvalidArgument, "polygonise cell is not positive");
  if (!(size.x > 0 && size.y > 0 && size.z > 0)) return fail(ErrorCode::InvalidArgument, "polygonise box is empty");
  if (!(std::max({size.x, size.y, size.z}) / cube < kMostCubes)) {
    return fail(ErrorCode::Limit, "polygonise box has over a million cells along one side");
  }
  const auto halves = [&](double mm) { return 2 * static_cast<int>(std::ceil(mm / cube)); };
  return Lattice{low, cube / 2, {halves(size.x), halves(size.y), halves(size.z)}};
}

/// A node moves onto the surface even where its part of it is too small to have triangles.
TriangleMesh withoutUnused(TriangleMesh mesh) {
  constexpr std::uint32_t kUnused = 0xffffffff;
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnused);
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t v : t) number[v] = 0;
  }
  std::uint32_t count = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kUnused) continue;
    mesh.vertices[count] = mesh.vertices[v];
    number[v] = count++;
  }
  mesh.vertices.resize(count);
  for (auto& t : mesh.triangles) t = {number[t[0]], number[t[1]], number[t[2]]};
  return mesh;
}

/// Moved nodes where sheets touch are put back until none do. A lattice whose nodes all stay has no pinch, so this
/// ends; where the surface is nowhere thinner than a cell, at once.
TriangleMesh unpinched(const Lattice& lattice, const Cloud& cloud, CrossingFinder& finder) {
  while (true) {
    Stuffed stuffed = stuff(cloud, lattice, finder.crossings());
    std::vector<std::uint32_t> back = std::move(stuffed.touching);
    for (const std::uint32_t p : pinchedVertices(stuffed.mesh, stuffed.vertices)) back.push_back(stuffed.nodes[p]);
    if (back.empty()) return withoutUnused(std::move(stuffed.mesh));
    finder.hold(back);
  }
}

Result<TriangleMesh> meshOf(const Field& field, const Lattice& lattice, const Cloud& cloud, const Progress& progress) {
  CrossingFinder finder(field, lattice, cloud);
  while (true) {
    if (auto ok = finder.refine(progress); !ok) return tl::unexpected(ok.error());
    TriangleMesh mesh = unpinched(lattice, cloud, finder);
    if (finder.isSettled()) return mesh;  // else the nodes put back made others move, on crossings not yet found
  }
}

/// The triangles' normals around each vertex, weighted by area; never zero, since no triangle is.
std::vector<Vec3> normalsOfTriangles(const TriangleMesh& mesh) {
  std::vector<Vec3> out(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    const Vec3& a = mesh.vertices[t[0]];
    const Vec3 area = cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
    for (const std::uint32_t v : t) out[v] += area;
  }
  return out;
}

/// Its largest component first becomes 1, so that no square under- or overflows. Zero stays zero.
Vec3 unit(const Vec3& v) {
  const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return most > 0 ? normalized(v / most) : v;
}

/// From the field's gradient; from the triangles where that vanishes or points into the bone, as it may on a crease.
Result<void> placeNormals(const Field& field, TriangleMesh& mesh) {
  mesh.normals.resize(mesh.vertices.size());
  field.gradients(mesh.vertices, mesh.normals);
  const std::vector<Vec3> from_triangles = normalsOfTriangles(mesh);
  for (std::size_t v = 0; v < mesh.normals.size(); ++v) {
    if (!isFinite(mesh.normals[v])) return notFinite(mesh.vertices[v]);
    const Vec3 from_field = unit(mesh.normals[v]);
    mesh.normals[v] = dot(from_field, from_triangles[v]) > 0 ? from_field : unit(from_triangles[v]);
  }
  return {};
}

/// The part of the whole that a stage reports as 0 to 1.
Progress partOf(const Progress& progress, double from, double to) {
  if (!progress) return {};
  return [&progress, from, to](double share) { progress(from + (to - from) * share); };
}

}  // namespace

Result<TriangleMesh> polygonise(const Field& field, std::span<const Vec3> seeds_patient,
                                const PolygoniseOptions& options, const Progress& progress) {
  const auto lattice = latticeOf(options);
  if (!lattice) return tl::unexpected(lattice.error());
  const auto cloud = follow(field, *lattice, seeds_patient, partOf(progress, 0, 0.4));
  if (!cloud) return tl::unexpected(cloud.error());
  auto mesh = meshOf(field, *lattice, *cloud, partOf(progress, 0.4, 0.7));
  if (!mesh) return mesh;
  if (mesh->triangles.empty()) return fail(ErrorCode::NotFound, "all surfaces near the seeds are smaller than a cell");
  if (auto ok = placeNormals(field, *mesh); !ok) return tl::unexpected(ok.error());
  if (progress) progress(1);
  return mesh;
}

}  // namespace spinaltap::mesh
