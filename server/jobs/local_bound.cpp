#include "server/jobs/local_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"
#include "server/jobs/codec.h"

namespace spinaltap::jobs {
namespace {

constexpr double kFirstEdge_mm = 4, kLastEdge_mm = 0.5;
constexpr double kGoodEnough = 3;  // a distance has slope 1: below this, splitting costs more than it saves
constexpr double kRounding = 1 + 1e-6;
constexpr std::size_t kLanes = 4;

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

/// A model's centres, one array a coordinate, filled up with weights of 0 to whole vectors.
struct Centres {
  std::vector<double> x, y, z, weight;

  explicit Centres(const rbf::Model& model) {
    const std::size_t padded = (model.centres.size() + kLanes - 1) / kLanes * kLanes;
    for (std::vector<double>* v : {&x, &y, &z, &weight}) v->assign(padded, 0.0);
    for (std::size_t i = 0; i < model.centres.size(); ++i) {
      x[i] = model.centres[i].x, y[i] = model.centres[i].y, z[i] = model.centres[i].z, weight[i] = model.weights[i];
    }
  }
};

/// A sum in lanes, so that the compiler may take them at once.
struct Sum {
  std::array<double, kLanes> lane{};
  [[nodiscard]] double all() const {
    double sum = 0;
    for (const double part : lane) sum += part;
    return sum;
  }
};

/// What the centres add to slope and second derivative at a point, and what they can add around it.
struct Slopes {
  Sum x, y, z, share, xx, yy, zz, xy, xz, yz;  // the second derivative is share * 1 - (xx xy ..)
  Sum near, third;

  void add(const Centres& c, std::size_t first, const Vec3& at, double radius) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t i = first + l;
      const double dx = at.x - c.x[i], dy = at.y - c.y[i], dz = at.z - c.z[i];
      const double distance = std::sqrt(dx * dx + dy * dy + dz * dz);
      const bool close = distance < 2 * radius;
      const double size = std::abs(c.weight[i]), weight = close ? 0.0 : c.weight[i];
      near.lane[l] += close ? size : 0.0;
      const double inverse = 1 / (close ? 2 * radius : distance), gap = (close ? 2 * radius : distance) - radius;
      const double w = weight * inverse, cube = w * inverse * inverse;
      const double cx = cube * dx, cy = cube * dy;
      x.lane[l] += w * dx, y.lane[l] += w * dy, z.lane[l] += w * dz, share.lane[l] += w;
      xx.lane[l] += cx * dx, yy.lane[l] += cy * dy, zz.lane[l] += cube * dz * dz;
      xy.lane[l] += cx * dy, xz.lane[l] += cx * dz, yz.lane[l] += cy * dz;
      third.lane[l] += (close ? 0.0 : size) / (gap * gap);
    }
  }
};

/// The steepest slope in the ball around `at` (relative to the model's centroid).
double slopeIn(const Centres& centres, const Vec3& linear, const Vec3& at, double radius) {
  Slopes sums;
  for (std::size_t i = 0; i < centres.x.size(); i += kLanes) sums.add(centres, i, at, radius);
  const Vec3 slope = linear + Vec3{sums.x.all(), sums.y.all(), sums.z.all()};
  const double share = sums.share.all();
  const double xx = share - sums.xx.all(), yy = share - sums.yy.all(), zz = share - sums.zz.all();
  const double xy = sums.xy.all(), xz = sums.xz.all(), yz = sums.yz.all();
  const double frobenius = std::sqrt(xx * xx + yy * yy + zz * zz + 2 * (xy * xy + xz * xz + yz * yz));
  return norm(slope) + sums.near.all() + radius * frobenius + 0.5 * 1.1548 * radius * radius * sums.third.all();
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

void split(const Cube& cube, std::vector<Cube>& parts) {
  const double quarter = 0.25 * cube.edge_mm;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 step{(corner & 1) != 0 ? quarter : -quarter, (corner & 2) != 0 ? quarter : -quarter,
                    (corner & 4) != 0 ? quarter : -quarter};
    parts.push_back({cube.centre + step, 0.5 * cube.edge_mm});
  }
}

}  // namespace

double lipschitzIn(const rbf::Model& model, const Cylinder& cylinder, unsigned threads) {
  const Centres centres(model);
  const double anywhere = lipschitzOf(model);
  const std::vector<Cube> first = firstCubes(cylinder);
  std::vector<double> steepest(first.size(), 0.0);
  parallelBlocks(first.size(), 1, threads, [&](std::size_t n, std::size_t) {
    std::vector<Cube> cubes{first[n]};
    while (!cubes.empty()) {
      const Cube cube = cubes.back();
      cubes.pop_back();
      if (misses(cube, cylinder)) continue;
      const Vec3 at = cylinder.frame.toPatient(cube.centre) - model.centroid_patient;
      const double slope = std::min(anywhere, slopeIn(centres, model.linear, at, cube.radius_mm()) * kRounding);
      if (slope <= std::max(kGoodEnough, steepest[n]) || cube.edge_mm <= kLastEdge_mm) {
        steepest[n] = std::max(steepest[n], slope);
      } else {
        split(cube, cubes);
      }
    }
  });
  double all = model.radius_mm > 0 ? 1 : 0;  // of the bound beyond the samples
  for (const double slope : steepest) all = std::max(all, slope);
  return all;
}

}  // namespace spinaltap::jobs
