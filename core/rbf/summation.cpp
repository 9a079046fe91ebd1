#include "core/rbf/summation.h"

#include <algorithm>
#include <cassert>
#include <memory>
#include <system_error>
#include <thread>

namespace spinaltap::rbf {
namespace {

// The loop over the points of a block is the one that vectorises: a sum over centres cannot, as its order is fixed.
constexpr std::size_t kBlock = 8;

struct Block {
  double x[kBlock], y[kBlock], z[kBlock];
};

/// The last block is filled up with its own last point.
Block load(const FlatModel& m, std::span<const Vec3> points, std::size_t first) {
  Block b;
  for (std::size_t lane = 0; lane < kBlock; ++lane) {
    const Vec3 p = points[std::min(first + lane, points.size() - 1)] - m.centroid_patient;
    b.x[lane] = p.x, b.y[lane] = p.y, b.z[lane] = p.z;
  }
  return b;
}

void blockValues(const FlatModel& m, const Block& b, double* sum) {
  for (std::size_t lane = 0; lane < kBlock; ++lane) {
    sum[lane] = m.constant + m.linear.x * b.x[lane] + m.linear.y * b.y[lane] + m.linear.z * b.z[lane];
  }
  for (std::size_t i = 0; i < m.weight.size(); ++i) {
    const double cx = m.x[i], cy = m.y[i], cz = m.z[i], w = m.weight[i];
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const double dx = b.x[lane] - cx, dy = b.y[lane] - cy, dz = b.z[lane] - cz;
      sum[lane] += w * std::sqrt(dx * dx + dy * dy + dz * dz);
    }
  }
}

void blockGradients(const FlatModel& m, const Block& b, Block& sum) {
  for (std::size_t lane = 0; lane < kBlock; ++lane) {
    sum.x[lane] = m.linear.x, sum.y[lane] = m.linear.y, sum.z[lane] = m.linear.z;
  }
  for (std::size_t i = 0; i < m.weight.size(); ++i) {
    const double cx = m.x[i], cy = m.y[i], cz = m.z[i], w = m.weight[i];
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const double dx = b.x[lane] - cx, dy = b.y[lane] - cy, dz = b.z[lane] - cz;
      const double r = std::sqrt(dx * dx + dy * dy + dz * dz);
      const double share = w / (r > 0 ? r : 1.0);  // at the centre dx, dy, dz are 0 and so is its part
      sum.x[lane] += share * dx, sum.y[lane] += share * dy, sum.z[lane] += share * dz;
    }
  }
}

void serialValues(const FlatModel& m, std::span<const Vec3> points, std::span<double> out) {
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const Block b = load(m, points, first);
    double sum[kBlock];
    blockValues(m, b, sum);
    const std::size_t count = std::min(kBlock, points.size() - first);
    for (std::size_t lane = 0; lane < count; ++lane) out[first + lane] = sum[lane];
  }
}

void serialGradients(const FlatModel& m, std::span<const Vec3> points, std::span<Vec3> out) {
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const Block b = load(m, points, first);
    Block sum;
    blockGradients(m, b, sum);
    const std::size_t count = std::min(kBlock, points.size() - first);
    for (std::size_t lane = 0; lane < count; ++lane) out[first + lane] = {sum.x[lane], sum.y[lane], sum.z[lane]};
  }
}

#ifdef __EMSCRIPTEN__
template <class Out, class Serial>
void inParts(const FlatModel& m, std::span<const Vec3> points, std::span<Out> out, Serial serial) {
  serial(m, points, out);
}
#else
// Below this many centre-point pairs (about a millisecond) a thread costs more than it saves.
constexpr std::size_t kPairsWorthAThread = 1'000'000;

/// Contiguous parts, one a thread; whichever part cannot get a thread is done here.
template <class Out, class Serial>
void inParts(const FlatModel& m, std::span<const Vec3> points, std::span<Out> out, Serial serial) {
  const std::size_t pairs = points.size() * (m.weight.size() + 1);
  const std::size_t useful = std::max<std::size_t>(1, pairs / kPairsWorthAThread);
  const std::size_t threads = std::min<std::size_t>(useful, std::max(1U, std::thread::hardware_concurrency()));
  const std::size_t part = (points.size() + threads - 1) / threads;
  std::vector<std::thread> others;
  for (std::size_t first = part; first < points.size(); first += part) {
    const std::size_t count = std::min(part, points.size() - first);
    const auto work = [&m, serial, in = points.subspan(first, count), to = out.subspan(first, count)] {
      serial(m, in, to);
    };
    try {
      others.emplace_back(work);
    } catch (const std::system_error&) {
      work();
    }
  }
  serial(m, points.first(std::min(part, points.size())), out);
  for (std::thread& other : others) other.join();
}
#endif

}  // namespace

FlatModel::FlatModel(const Model& model)
    : centroid_patient(model.centroid_patient), weight(model.weights), constant(model.constant), linear(model.linear) {
  assert(model.centres.size() == model.weights.size());
  for (const Vec3& c : model.centres) x.push_back(c.x), y.push_back(c.y), z.push_back(c.z);
}

void sumValues(const FlatModel& model, std::span<const Vec3> points_patient, std::span<double> out) {
  assert(points_patient.size() == out.size());
  if (!points_patient.empty()) inParts(model, points_patient, out, serialValues);
}

void sumGradients(const FlatModel& model, std::span<const Vec3> points_patient, std::span<Vec3> out) {
  assert(points_patient.size() == out.size());
  if (!points_patient.empty()) inParts(model, points_patient, out, serialGradients);
}

void evaluate(const Model& model, std::span<const Vec3> points_patient, std::span<double> out) {
  sumValues(FlatModel(model), points_patient, out);
}

void evaluateGradient(const Model& model, std::span<const Vec3> points_patient, std::span<Vec3> out) {
  sumGradients(FlatModel(model), points_patient, out);
}

Field asField(const Model& model, double lipschitz) {
  const auto flat = std::make_shared<const FlatModel>(model);
  Field field;
  field.values = [flat](std::span<const Vec3> p, std::span<double> out) { sumValues(*flat, p, out); };
  field.gradients = [flat](std::span<const Vec3> p, std::span<Vec3> out) { sumGradients(*flat, p, out); };
  field.lipschitz = lipschitz;
  return field;
}

}  // namespace spinaltap::rbf
