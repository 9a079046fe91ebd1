#include "core/surface/candidates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/base/parallel.h"
#include "core/surface/neighbours.h"

namespace spinaltap::surface {
namespace {

constexpr double kLatticeStep = 0.7;  // of the spacing: more places than are kept
constexpr std::size_t kLayers = 8;    // a block's; one more is evaluated twice for each

/// Slides a place near the boundary onto the half-way level; none where there is no slope, or outside the volume.
std::optional<Candidate> settle(const SmoothLabel& label, Vec3 place, double longest_step) {
  Vec3 gradient;
  for (int round = 0; round < 3; ++round) {
    gradient = label.gradient(place);
    const double square = dot(gradient, gradient);
    if (!(square > 1e-6)) return std::nullopt;
    Vec3 step = gradient * ((0.5 - label.value(place)) / square);
    if (const double length = norm(step); length > longest_step) step *= longest_step / length;
    place += step;
  }
  if (std::abs(label.value(place) - 0.5) > 0.1) return std::nullopt;
  const Vec3 low = label.low(), high = label.high();
  if (place.x < low.x || place.y < low.y || place.z < low.z) return std::nullopt;
  if (place.x > high.x || place.y > high.y || place.z > high.z) return std::nullopt;
  return Candidate{place, -normalized(gradient), false};
}

/// Nodes low + step * (i, j, k); the last ones lie beyond the box.
struct Lattice {
  Vec3 low;
  double step;
  std::array<std::size_t, 3> n;

  Lattice(const SmoothLabel& label, double step_mm) : low(label.low()), step(step_mm) {
    const Vec3 size = label.high() - low;
    const auto nodes = [&](double length) { return static_cast<std::size_t>(length / step) + 2; };
    n = {nodes(size.x), nodes(size.y), nodes(size.z)};
  }
  [[nodiscard]] Vec3 at(std::size_t i, std::size_t j, std::size_t k) const {
    return low + Vec3{step * static_cast<double>(i), step * static_cast<double>(j), step * static_cast<double>(k)};
  }
};

/// Where the edges of the lattice's layers [first, last) and those down to the layer before cross the level.
void crossLayers(const SmoothLabel& label, const Lattice& lattice, std::size_t first, std::size_t last,
                 std::vector<Candidate>& out) {
  const std::size_t nx = lattice.n[0], ny = lattice.n[1];
  const auto index = [&](std::size_t i, std::size_t j) { return j * nx + i; };
  std::vector<double> layer(nx * ny), below;
  const auto fill = [&](std::size_t k) {
    for (std::size_t j = 0; j < ny; ++j)
      for (std::size_t i = 0; i < nx; ++i) layer[index(i, j)] = label.value(lattice.at(i, j, k));
  };
  const auto crossEdge = [&](const Vec3& a, const Vec3& b, double at_a, double at_b) {
    if ((at_a > 0.5) == (at_b > 0.5)) return;
    const Vec3 start = a + (b - a) * ((0.5 - at_a) / (at_b - at_a));
    if (const auto settled = settle(label, start, lattice.step)) out.push_back(*settled);
  };
  if (first > 0) fill(first - 1), below = layer;
  for (std::size_t k = first; k < last; ++k) {
    fill(k);
    for (std::size_t j = 0; j < ny; ++j) {
      for (std::size_t i = 0; i < nx; ++i) {
        const Vec3 here = lattice.at(i, j, k);
        const double value = layer[index(i, j)];
        if (i > 0) crossEdge(lattice.at(i - 1, j, k), here, layer[index(i - 1, j)], value);
        if (j > 0) crossEdge(lattice.at(i, j - 1, k), here, layer[index(i, j - 1)], value);
        if (k > 0) crossEdge(lattice.at(i, j, k - 1), here, below[index(i, j)], value);
      }
    }
    below = layer;
  }
}

double& part(Vec3& v, std::size_t axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

/// The volume's six faces, where the label reaches them: the bone goes on there, but nobody can know how.
void cutFaces(const SmoothLabel& label, const Lattice& lattice, std::vector<Candidate>& out) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      Vec3 normal, end = side < 0 ? label.low() : label.high(), high = label.high();
      part(normal, axis) = side;
      for (std::size_t b = 0; b < lattice.n[v]; ++b) {
        for (std::size_t a = 0; a < lattice.n[u]; ++a) {
          Vec3 place = lattice.low;
          part(place, axis) = part(end, axis);
          part(place, u) += lattice.step * static_cast<double>(a);
          part(place, v) += lattice.step * static_cast<double>(b);
          if (part(place, u) > part(high, u) || part(place, v) > part(high, v)) continue;
          if (label.value(place) > 0.5) out.push_back({place, normal, true});
        }
      }
    }
  }
}

/// Keeps candidates that are at least `spacing` from every one kept before on the same wall: the two of a thin plate
/// leave each other alone.
std::vector<Candidate> thinned(const std::vector<Candidate>& all, double spacing) {
  std::vector<Vec3> places;
  places.reserve(all.size());
  for (const Candidate& c : all) places.push_back(c.place_mm);
  const Neighbours near(places, spacing);
  std::vector<std::uint8_t> blocked(all.size(), 0);
  std::vector<Candidate> out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (blocked[i] != 0) continue;
    out.push_back(all[i]);
    near.eachWithin(places[i], spacing, [&](std::size_t n) {
      if (dot(all[n].normal, all[i].normal) > 0) blocked[n] = 1;
    });
  }
  return out;
}

}  // namespace

std::vector<Candidate> candidatesOn(const SmoothLabel& label, double spacing_mm) {
  const Lattice lattice(label, kLatticeStep * spacing_mm);
  std::vector<std::vector<Candidate>> blocks((lattice.n[2] + kLayers - 1) / kLayers);
  parallelBlocks(lattice.n[2], kLayers, 0, [&](std::size_t first, std::size_t last) {
    crossLayers(label, lattice, first, last, blocks[first / kLayers]);
  });
  std::vector<Candidate> all;
  for (const auto& block : blocks) all.insert(all.end(), block.begin(), block.end());
  cutFaces(label, lattice, all);
  return thinned(all, spacing_mm);
}

}  // namespace spinaltap::surface
