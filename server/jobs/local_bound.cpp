#include "server/jobs/local_bound.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/jobs/codec.h"

namespace spinaltap::jobs {
namespace {

constexpr double kFirstEdge_mm = 4, kLastEdge_mm = 0.5;
constexpr double kGoodEnough = 2;  // a distance has slope 1: below this, splitting costs more than it saves
constexpr double kRounding = 1 + 1e-6;

struct Cube {
  Vec3 centre;  // path frame
  double edge_mm;
  [[nodiscard]] double radius_mm() const { return 0.5 * std::sqrt(3.0) * edge_mm; }
};

bool misses(const Cube& cube, const Cylinder& cylinder) {
  const double r = cube.radius_mm();
  return std::hypot(cube.centre.x, cube.centre.y) - r > cylinder.radius_mm || cube.centre.z + r < cylinder.low_z_mm ||
         cube.centre.z - r > cylinder.high_z_mm;
}

/// Of the symmetric second derivative: xx yy zz xy xz yz.
struct Second {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  [[nodiscard]] double frobenius() const {
    return std::sqrt(xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz));
  }
};

/// The steepest slope in the ball around `at` (relative to the model's centroid).
double slopeIn(const rbf::Model& model, const Vec3& at, double radius) {
  Vec3 slope = model.linear;
  Second second;
  double near = 0, third = 0;
  for (std::size_t i = 0; i < model.centres.size(); ++i) {
    const Vec3 d = at - model.centres[i];
    const double distance = norm(d), weight = model.weights[i];
    if (distance < 2 * radius) {
      near += std::abs(weight);
      continue;
    }
    const double share = weight / distance, cube = share / (distance * distance), gap = distance - radius;
    slope += d * share;
    second.xx += share - cube * d.x * d.x, second.yy += share - cube * d.y * d.y, second.zz += share - cube * d.z * d.z;
    second.xy -= cube * d.x * d.y, second.xz -= cube * d.x * d.z, second.yz -= cube * d.y * d.z;
    third += std::abs(weight) / (gap * gap);
  }
  return norm(slope) + near + radius * second.frobenius() + 0.5 * 1.1548 * radius * radius * third;
}

std::vector<Cube> firstCubes(const Cylinder& cylinder) {
  std::vector<Cube> cubes;
  const int across = static_cast<int>(std::ceil(cylinder.radius_mm / kFirstEdge_mm));
  const int along = static_cast<int>(std::ceil((cylinder.high_z_mm - cylinder.low_z_mm) / kFirstEdge_mm));
  for (int i = -across; i < across; ++i) {
    for (int j = -across; j < across; ++j) {
      for (int k = 0; k < along; ++k) {
        const Vec3 corner{i * kFirstEdge_mm, j * kFirstEdge_mm, cylinder.low_z_mm + k * kFirstEdge_mm};
        cubes.push_back({corner + Vec3{0.5, 0.5, 0.5} * kFirstEdge_mm, kFirstEdge_mm});
      }
    }
  }
  return cubes;
}

}  // namespace

double lipschitzIn(const rbf::Model& model, const Cylinder& cylinder) {
  const double anywhere = lipschitzOf(model);
  double steepest = model.radius_mm > 0 ? 1 : 0;  // of the bound beyond the samples
  std::vector<Cube> cubes = firstCubes(cylinder);
  while (!cubes.empty()) {
    const Cube cube = cubes.back();
    cubes.pop_back();
    if (misses(cube, cylinder)) continue;
    const Vec3 at = cylinder.frame.toPatient(cube.centre) - model.centroid_patient;
    const double slope = std::min(anywhere, slopeIn(model, at, cube.radius_mm()) * kRounding);
    if (slope <= std::max(kGoodEnough, steepest) || cube.edge_mm <= kLastEdge_mm) {
      steepest = std::max(steepest, slope);
      continue;
    }
    const double quarter = 0.25 * cube.edge_mm;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 step{(corner & 1) != 0 ? quarter : -quarter, (corner & 2) != 0 ? quarter : -quarter,
                      (corner & 4) != 0 ? quarter : -quarter};
      cubes.push_back({cube.centre + step, 0.5 * cube.edge_mm});
    }
  }
  return steepest;
}

}  // namespace spinaltap::jobs
