#include "tests/bench/marching_cubes.h"

#include <cmath>
#include <unordered_map>

#include "tests/bench/cube_table.h"

namespace spinaltap::mesh {

TriangleMesh marchingCubes(const Field& field, const PolygoniseOptions& options) {
  const Vec3 size = options.high_patient - options.low_patient;
  const auto count = [&](double mm) { return static_cast<std::size_t>(std::ceil(mm / options.cell_mm)) + 1; };
  const std::size_t nx = count(size.x), ny = count(size.y), nz = count(size.z);
  std::vector<Vec3> places;
  places.reserve(nx * ny * nz);
  for (std::size_t k = 0; k < nz; ++k)
    for (std::size_t j = 0; j < ny; ++j)
      for (std::size_t i = 0; i < nx; ++i) {
        places.push_back(options.low_patient + Vec3{double(i), double(j), double(k)} * options.cell_mm);
      }
  std::vector<double> values(places.size());
  field.values(places, values);

  TriangleMesh mesh;
  std::unordered_map<std::size_t, std::uint32_t> vertices;  // of edges: 3 * node + axis
  const std::size_t step[3] = {1, nx, nx * ny};
  const auto vertexAt = [&](std::size_t cell, int edge) {
    const CubeEdge e = cubeEdge(edge);
    const auto corner = static_cast<std::size_t>(e.corner), axis = static_cast<std::size_t>(e.axis);
    const std::size_t a = cell + (corner & 1) * step[0] + (corner >> 1 & 1) * step[1] + (corner >> 2) * step[2];
    const auto [found, made] = vertices.try_emplace(3 * a + axis, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (made) {
      const std::size_t b = a + step[axis];
      mesh.vertices.push_back(places[a] + (places[b] - places[a]) * (values[a] / (values[a] - values[b])));
    }
    return found->second;
  };
  for (std::size_t k = 0; k + 1 < nz; ++k)
    for (std::size_t j = 0; j + 1 < ny; ++j)
      for (std::size_t i = 0; i + 1 < nx; ++i) {
        const std::size_t cell = (k * ny + j) * nx + i;
        std::size_t mask = 0;
        for (std::size_t c = 0; c < 8; ++c) {
          if (values[cell + (c & 1) * step[0] + (c >> 1 & 1) * step[1] + (c >> 2) * step[2]] < 0) mask |= 1U << c;
        }
        for (const auto& t : cubeTable().triangles[mask]) {
          mesh.triangles.push_back({vertexAt(cell, t[0]), vertexAt(cell, t[1]), vertexAt(cell, t[2])});
        }
      }
  mesh.normals.resize(mesh.vertices.size());
  field.gradients(mesh.vertices, mesh.normals);
  return mesh;
}

}  // namespace spinaltap::mesh
