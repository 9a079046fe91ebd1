#include "core/tradeoff/measure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/box.h"
#include "core/base/parallel.h"
#include "core/base/random.h"
#include "core/surface/local_shape.h"

namespace spinaltap::tradeoff {
namespace {

constexpr std::size_t kBlock = 64;
constexpr int kNewtonSteps = 5;
constexpr double kAround_mm = 4.0;  // of the bone's box, where sides are asked

Vec3 randomIn(const Box& box, Random& r) {
  return {r.uniform(box.low.x, box.high.x), r.uniform(box.low.y, box.high.y), r.uniform(box.low.z, box.high.z)};
}

Box boxOf(const phantom::Phantom& truth, double margin_mm) {
  const auto bounds = truth.bounds();
  return Box{bounds.low_patient, bounds.high_patient}.widened(margin_mm);
}

/// values[i] = measure(points[i]), on all threads.
template <class Measure>
std::vector<double> eachOf(const std::vector<Vec3>& points, const Measure& measure) {
  std::vector<double> out(points.size());
  parallelBlocks(points.size(), kBlock, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) out[i] = measure(points[i]);
  });
  return out;
}

/// One step towards the zero set, no longer than most_mm.
void stepDown(const Field& field, double most_mm, std::vector<Vec3>& feet, std::vector<double>& values,
              std::vector<Vec3>& gradients) {
  field.gradients(feet, gradients);
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const double square = dot(gradients[i], gradients[i]);
    Vec3 step = square > 1e-12 ? gradients[i] * (-values[i] / square) : Vec3{};
    if (const double length = norm(step); length > most_mm) step *= most_mm / length;
    feet[i] += step;
  }
  field.values(feet, values);
}

/// Cells begin .. end-1 along each axis; cell (i, j, k) is the one whose centre is that many cells from the origin.
struct Cells {
  std::array<int, 3> begin{}, end{};
};

/// How many cells have their centre in bone: a block that the Lipschitz bound decides is counted whole, others halved.
std::int64_t cellsInside(const phantom::Phantom& truth, const Vec3& origin, double cell_mm, const Cells& cells) {
  std::array<int, 3> count{};
  for (std::size_t a = 0; a < 3; ++a) count[a] = cells.end[a] - cells.begin[a];
  const auto middle = [&](std::size_t a) { return 0.5 * (cells.begin[a] + cells.end[a] - 1) * cell_mm; };
  const double value = truth.signedDistance(origin + Vec3{middle(0), middle(1), middle(2)});
  const Vec3 half = Vec3{count[0] - 1.0, count[1] - 1.0, count[2] - 1.0} * (0.5 * cell_mm);
  if (std::abs(value) >= phantom::Phantom::kLipschitz * norm(half)) {
    return value < 0 ? static_cast<std::int64_t>(count[0]) * count[1] * count[2] : 0;
  }
  const auto longest = static_cast<std::size_t>(std::max_element(count.begin(), count.end()) - count.begin());
  Cells first = cells, second = cells;
  first.end[longest] = second.begin[longest] = (cells.begin[longest] + cells.end[longest]) / 2;
  return cellsInside(truth, origin, cell_mm, first) + cellsInside(truth, origin, cell_mm, second);
}

}  // namespace

Distances summarise(std::vector<double> signed_mm) {
  Distances out;
  out.count = signed_mm.size();
  if (signed_mm.empty()) return out;
  double sum = 0, squares = 0;
  for (double& d : signed_mm) sum += d, squares += d * d, d = std::abs(d);
  const auto count = static_cast<double>(out.count);
  std::sort(signed_mm.begin(), signed_mm.end());
  const auto at = [&](double share) { return signed_mm[static_cast<std::size_t>(share * (count - 1))]; };
  out.mean_mm = sum / count, out.rms_mm = std::sqrt(squares / count);
  out.p95_mm = at(0.95), out.p99_mm = at(0.99), out.most_mm = signed_mm.back();
  return out;
}

std::vector<Vec3> pointsOn(const mesh::TriangleMesh& mesh, std::size_t count, std::uint64_t seed) {
  std::vector<double> area_to;  // summed up to and with each triangle
  area_to.reserve(mesh.triangles.size());
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3& a = mesh.vertices[t[0]];
    area += 0.5 * norm(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a));
    area_to.push_back(area);
  }
  Random random(seed);
  std::vector<Vec3> out;
  out.reserve(count);
  for (std::size_t n = 0; n < count; ++n) {
    const auto at = std::lower_bound(area_to.begin(), area_to.end() - 1, random.uniform(0, area)) - area_to.begin();
    const auto& t = mesh.triangles[static_cast<std::size_t>(at)];
    double a = random.unit(), b = random.unit();
    if (a + b > 1) a = 1 - a, b = 1 - b;
    out.push_back(mesh.vertices[t[0]] * (1 - a - b) + mesh.vertices[t[1]] * a + mesh.vertices[t[2]] * b);
  }
  return out;
}

Distances fromTruth(const mesh::TriangleMesh& mesh, const phantom::Phantom& truth, std::size_t count,
                    std::uint64_t seed) {
  return summarise(eachOf(pointsOn(mesh, count, seed), [&](const Vec3& p) { return truth.distanceToSurface(p); }));
}

Distances toSurface(const Field& field, const std::vector<Vec3>& points, double most_mm) {
  std::vector<Vec3> feet = points, gradients(points.size());
  std::vector<double> values(points.size());
  field.values(feet, values);
  std::vector<double> distances = values;  // the sign is that of the point
  for (int step = 0; step < kNewtonSteps; ++step) stepDown(field, most_mm, feet, values, gradients);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // What the last step left over is added: a foot that never settles must not look near.
    const double away = std::min(norm(feet[i] - points[i]) + std::abs(values[i]), most_mm);
    distances[i] = std::copysign(away, distances[i]);
  }
  return summarise(std::move(distances));
}

std::vector<Vec3> pointsOfTruth(const phantom::Phantom& truth, std::size_t count, std::uint64_t seed) {
  const Box box = boxOf(truth, 1.0);
  Random random(seed);
  std::vector<Vec3> out;
  while (out.size() < count) {
    Vec3 p = randomIn(box, random);
    if (std::abs(truth.signedDistance(p)) > 1.0) continue;
    for (int step = 0; step < kNewtonSteps; ++step) {
      const Vec3 g = truth.gradient(p);
      p -= g * (truth.signedDistance(p) / dot(g, g));
    }
    if (std::abs(truth.signedDistance(p)) < 1e-9) out.push_back(p);
  }
  return out;
}

Sides sidesOf(const Field& field, const phantom::Phantom& truth, double margin_mm, std::size_t count,
              std::uint64_t seed) {
  const Box box = boxOf(truth, kAround_mm);
  Random random(seed);
  std::vector<Vec3> points;
  points.reserve(count);
  for (std::size_t n = 0; n < count; ++n) points.push_back(randomIn(box, random));
  // The slow exact distance only where the Lipschitz bound cannot tell.
  const std::vector<double> distances = eachOf(points, [&](const Vec3& p) {
    const double near = truth.signedDistance(p);
    return std::abs(near) > margin_mm * phantom::Phantom::kLipschitz ? near : truth.distanceToSurface(p);
  });
  std::vector<double> fitted(count);
  field.values(points, fitted);
  Sides out;
  for (std::size_t i = 0; i < count; ++i) {
    if (std::abs(distances[i]) <= margin_mm) continue;
    ++out.asked;
    out.wrong += (fitted[i] < 0) != (distances[i] < 0) ? 1 : 0;
  }
  return out;
}

double roughnessOf(const mesh::TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  const surface::Neighbours near(mesh.vertices, kRoughnessRadius_mm);
  const surface::SurfacePoints points{mesh.vertices, mesh.normals, &near};
  // Some 5,000 vertices tell it to a hundredth of itself.
  const std::size_t stride = std::max<std::size_t>(1, mesh.vertices.size() / 5000);
  const std::size_t count = (mesh.vertices.size() + stride - 1) / stride;
  std::vector<double> squares(count);
  parallelBlocks(count, kBlock, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      squares[n] = std::pow(surface::shapeAround(points, n * stride, kRoughnessRadius_mm).rms_mm, 2);
    }
  });
  double sum = 0;
  for (const double s : squares) sum += s;
  return std::sqrt(sum / static_cast<double>(count));
}

double volumeOf(const mesh::TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return 0;
  const Vec3 origin = mesh.vertices.front();  // a far one would cost digits
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += dot(mesh.vertices[t[0]] - origin, cross(mesh.vertices[t[1]] - origin, mesh.vertices[t[2]] - origin));
  }
  return sum / 6;
}

double volumeOf(const phantom::Phantom& truth, double cell_mm) {
  const Box box = boxOf(truth, 0);
  Cells cells;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = axis == 0   ? box.high.x - box.low.x
                        : axis == 1 ? box.high.y - box.low.y
                                    : box.high.z - box.low.z;
    cells.end[axis] = static_cast<int>(size / cell_mm) + 1;
  }
  return static_cast<double>(cellsInside(truth, box.low, cell_mm, cells)) * std::pow(cell_mm, 3);
}

}  // namespace spinaltap::tradeoff
