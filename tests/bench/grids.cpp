#include "tests/bench/grids.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/drill/bounds.h"
#include "core/drill/predicate.h"

namespace spinaltap::bench {
namespace {

using drill::BitPose;
using drill::BitShape;

/// A grid of the lattice's spacing that holds its cylinder: x and y from -half to half, z as its discs.
struct Shape {
  Shape(const point_volume::Lattice& lattice, const plan::Bit& bit)
      : bit_shape(drill::shapeOf(bit)),
        spacing(lattice.spacing_mm),
        half(lattice.rings - 1),
        slices(lattice.discs),
        first_slice(lattice.first_disc),
        wide(2 * half + 1) {}
  [[nodiscard]] double at(int i) const { return (i - half) * spacing; }
  [[nodiscard]] double z(int slice) const { return (first_slice + slice) * spacing; }
  [[nodiscard]] bool inCylinder(int i, int j) const {
    return (i - half) * (i - half) + (j - half) * (j - half) <= half * half;
  }
  /// Calls visit(i, j, slice) for every place in the cylinder.
  template <class Visit>
  void forEachInCylinder(Visit&& visit) const {
    for (int slice = 0; slice < slices; ++slice)
      for (int j = 0; j < wide; ++j)
        for (int i = 0; i < wide; ++i)
          if (inCylinder(i, j)) visit(i, j, slice);
  }
  [[nodiscard]] int held(double v, int limit) const {
    return static_cast<int>(std::min(std::max(v, 0.0), static_cast<double>(limit)));
  }

  BitShape bit_shape;
  double spacing;
  int half, slices, first_slice, wide;
};

struct Range {
  int first, last;
};

/// Slices that the bit reaches, and the box of rows around it on one.
Range slicesOf(const Shape& shape, const BitPose& pose) {
  const drill::Span reach = drill::reachAlongPath(shape.bit_shape, pose);
  return {
      shape.held(std::ceil(reach.low_mm / shape.spacing - shape.first_slice), shape.slices),
      static_cast<int>(std::min(std::floor(reach.high_mm / shape.spacing - shape.first_slice), shape.slices - 1.0))};
}

Range rowsOf(const Shape& shape, double middle, double radius) {
  return {shape.held(std::ceil((middle - radius) / shape.spacing + shape.half), shape.wide),
          static_cast<int>(std::min(std::floor((middle + radius) / shape.spacing + shape.half), shape.wide - 1.0))};
}

class Bytes final : public Grid {
 public:
  Bytes(const point_volume::Lattice& lattice, const plan::Bit& bit, std::uint16_t density)
      : shape_(lattice, bit),
        alive_(static_cast<std::size_t>(shape_.wide) * static_cast<std::size_t>(shape_.wide) *
               static_cast<std::size_t>(shape_.slices)),
        density_(alive_.size(), density) {
    shape_.forEachInCylinder([&](int i, int j, int z) { alive_[row(j, z) + static_cast<std::size_t>(i)] = 1; });
  }
  drill::Removal step(const BitPose& pose) override {
    drill::Removal removal;
    const Range slices = slicesOf(shape_, pose);
    for (int z = slices.first; z <= slices.last; ++z) {
      const drill::Circle circle = drill::sectionCircle(shape_.bit_shape, pose, shape_.z(z));
      if (circle.radius_mm < 0) continue;
      const Range rows = rowsOf(shape_, circle.y_mm, circle.radius_mm),
                  x = rowsOf(shape_, circle.x_mm, circle.radius_mm);
      for (int j = rows.first; j <= rows.last; ++j) {
        for (int i = x.first; i <= x.last; ++i) {
          const std::size_t index = row(j, z) + static_cast<std::size_t>(i);
          if (alive_[index] == 0) continue;
          ++removal.tested;
          if (!drill::isInside(shape_.bit_shape, pose.tip_mm, pose.axis, {shape_.at(i), shape_.at(j), shape_.z(z)}))
            continue;
          alive_[index] = 0;
          ++removal.count, removal.density_sum_mg_cm3 += density_[index];
        }
      }
    }
    return removal;
  }
  [[nodiscard]] std::size_t points() const override { return alive_.size(); }
  [[nodiscard]] std::size_t bytes() const override { return alive_.size() * 3; }

 private:
  [[nodiscard]] std::size_t row(int j, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(shape_.wide) + static_cast<std::size_t>(j)) *
           static_cast<std::size_t>(shape_.wide);
  }
  Shape shape_;
  std::vector<std::uint8_t> alive_;
  std::vector<std::uint16_t> density_;
};

/// Where a row y, z runs inside the bit: the bit is convex, the intersection of cylinder, cone and slab.
class Row {
 public:
  Row(const BitShape& bit, const BitPose& pose, double y, double z) {
    // From the tip, p = (x, py, pz); along = -p . axis = alpha - ax x.
    const double py = y - pose.tip_mm.y, pz = z - pose.tip_mm.z, ax = pose.axis.x;
    const double alpha = -(py * pose.axis.y + pz * pose.axis.z), rest = py * py + pz * pz;
    linear(-ax, alpha);                 // along >= 0
    linear(ax, bit.length_mm - alpha);  // along <= length
    // |p|^2 - along^2 <= R^2, and <= k^2 along^2.
    quadratic(1 - ax * ax, alpha * ax, rest - alpha * alpha - bit.radius_squared);
    if (bit.cone_mm > 0) {
      const double k = 1 + bit.radius_per_cone * bit.radius_per_cone;
      quadratic(1 - k * ax * ax, k * alpha * ax, rest - k * alpha * alpha);
    }
    low_ += pose.tip_mm.x, high_ += pose.tip_mm.x;
  }
  [[nodiscard]] double low() const { return low_; }
  [[nodiscard]] double high() const { return high_; }

 private:
  void linear(double slope, double offset) {  // slope x + offset >= 0
    if (slope > 0) low_ = std::max(low_, -offset / slope);
    if (slope < 0) high_ = std::min(high_, -offset / slope);
    if (slope == 0 && offset < 0) high_ = low_ - 1;
  }
  void quadratic(double a, double b, double c) {  // a x^2 + 2 b x + c <= 0
    if (a <= 0) return;                           // not an ellipse: left to the others
    const double root = b * b - a * c;
    if (root < 0) {
      high_ = low_ - 1;
      return;
    }
    low_ = std::max(low_, (-b - std::sqrt(root)) / a), high_ = std::min(high_, (-b + std::sqrt(root)) / a);
  }
  double low_ = -1e9, high_ = 1e9;
};

class Rows final : public Grid {
 public:
  Rows(const point_volume::Lattice& lattice, const plan::Bit& bit, std::uint16_t density)
      : shape_(lattice, bit),
        words_((static_cast<std::size_t>(shape_.wide) + 63) / 64),
        alive_(words_ * static_cast<std::size_t>(shape_.wide) * static_cast<std::size_t>(shape_.slices), 0),
        density_(alive_.size() * 64, density) {
    shape_.forEachInCylinder([&](int i, int j, int z) {
      alive_[row(j, z) + static_cast<std::size_t>(i) / 64] |= std::uint64_t{1} << (i % 64);
    });
  }
  drill::Removal step(const BitPose& pose) override {
    drill::Removal removal;
    const Range slices = slicesOf(shape_, pose);
    for (int z = slices.first; z <= slices.last; ++z) {
      const drill::Circle circle = drill::sectionCircle(shape_.bit_shape, pose, shape_.z(z));
      if (circle.radius_mm < 0) continue;
      const Range rows = rowsOf(shape_, circle.y_mm, circle.radius_mm);
      for (int j = rows.first; j <= rows.last; ++j) {
        const Row span(shape_.bit_shape, pose, shape_.at(j), shape_.z(z));
        const int first = shape_.held(std::ceil(span.low() / shape_.spacing + shape_.half), shape_.wide);
        const int last = static_cast<int>(
            std::min(std::max(std::floor(span.high() / shape_.spacing + shape_.half), -1.0), shape_.wide - 1.0));
        if (first <= last) clear(row(j, z), static_cast<std::size_t>(first), static_cast<std::size_t>(last), removal);
      }
    }
    return removal;
  }
  [[nodiscard]] std::size_t points() const override {
    return static_cast<std::size_t>(shape_.wide) * static_cast<std::size_t>(shape_.wide) *
           static_cast<std::size_t>(shape_.slices);
  }
  [[nodiscard]] std::size_t bytes() const override { return alive_.size() * 8 + density_.size() * 2; }

 private:
  [[nodiscard]] std::size_t row(int j, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(shape_.wide) + static_cast<std::size_t>(j)) * words_;
  }
  void clear(std::size_t start, std::size_t first, std::size_t last, drill::Removal& removal) {
    for (std::size_t word = first / 64; word <= last / 64; ++word) {
      std::uint64_t mask = ~std::uint64_t{0};
      if (word == first / 64) mask &= ~std::uint64_t{0} << (first % 64);
      if (word == last / 64) mask &= ~std::uint64_t{0} >> (63 - last % 64);
      std::uint64_t gone = alive_[start + word] & mask;
      if (gone == 0) continue;
      alive_[start + word] &= ~gone;
      for (; gone != 0; gone &= gone - 1) {
        ++removal.count;
        removal.density_sum_mg_cm3 += density_[(start + word) * 64 + static_cast<std::size_t>(__builtin_ctzll(gone))];
      }
    }
  }
  Shape shape_;
  std::size_t words_;
  std::vector<std::uint64_t> alive_;
  std::vector<std::uint16_t> density_;
};

}  // namespace

std::unique_ptr<Grid> makeGrid(std::string_view name, const point_volume::Lattice& lattice, const plan::Bit& bit,
                               std::uint16_t density_mg_cm3) {
  if (name == "bytes") return std::make_unique<Bytes>(lattice, bit, density_mg_cm3);
  if (name == "rows") return std::make_unique<Rows>(lattice, bit, density_mg_cm3);
  return nullptr;
}

}  // namespace spinaltap::bench
