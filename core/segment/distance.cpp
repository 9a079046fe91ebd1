#include "core/segment/distance.h"

#include <algorithm>
#include <limits>

namespace spinaltap::segment {
namespace {

constexpr float kFar = 1e30F;

/// The lower envelope of parabolas over one line of voxels.
class Line {
 public:
  Line(std::size_t longest, double spacing)
      : square_(spacing * spacing), values_(longest), apex_(longest), from_(longest + 1) {}

  void transform(float* first, std::size_t count, std::size_t stride) {
    for (std::size_t q = 0; q < count; ++q) values_[q] = first[q * stride];
    if (!buildEnvelope(count)) return;  // nothing on this line: it stays far
    std::size_t k = 0;
    for (std::size_t q = 0; q < count; ++q) {
      while (from_[k + 1] < static_cast<double>(q)) ++k;
      const double d = static_cast<double>(q) - static_cast<double>(apex_[k]);
      first[q * stride] = static_cast<float>(square_ * d * d + values_[apex_[k]]);
    }
  }

 private:
  bool buildEnvelope(std::size_t count) {
    const double infinity = std::numeric_limits<double>::infinity();
    std::size_t parabolas = 0;
    for (std::size_t q = 0; q < count; ++q) {
      if (values_[q] >= kFar) continue;
      double meet = -infinity;
      while (parabolas > 0) {
        meet = meeting(apex_[parabolas - 1], q);
        if (meet > from_[parabolas - 1]) break;
        --parabolas;
      }
      if (parabolas == 0) meet = -infinity;
      apex_[parabolas] = q, from_[parabolas] = meet;
      from_[++parabolas] = infinity;
    }
    return parabolas > 0;
  }

  [[nodiscard]] double meeting(std::size_t p, std::size_t q) const {
    const double a = static_cast<double>(p), b = static_cast<double>(q);
    return ((values_[q] + square_ * b * b) - (values_[p] + square_ * a * a)) / (2 * square_ * (b - a));
  }

  double square_;
  std::vector<double> values_;
  std::vector<std::size_t> apex_;
  std::vector<double> from_;
};

}  // namespace

std::vector<float> squaredDistances(const Mask& mask, std::uint8_t wanted) {
  std::vector<float> out(mask.set.size());
  std::transform(mask.set.begin(), mask.set.end(), out.begin(),
                 [wanted](std::uint8_t v) { return v == wanted ? 0.0F : kFar; });
  const std::size_t n[3] = {static_cast<std::size_t>(mask.dims[0]), static_cast<std::size_t>(mask.dims[1]),
                            static_cast<std::size_t>(mask.dims[2])};
  const std::size_t stride[3] = {1, n[0], n[0] * n[1]};
  const double spacing[3] = {mask.spacing_mm.x, mask.spacing_mm.y, mask.spacing_mm.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    Line line(n[axis], spacing[axis]);
    for (std::size_t b = 0; b < n[v]; ++b) {
      for (std::size_t a = 0; a < n[u]; ++a) {
        line.transform(out.data() + a * stride[u] + b * stride[v], n[axis], stride[axis]);
      }
    }
  }
  return out;
}

Mask dilated(const Mask& mask, double radius_mm) {
  const std::vector<float> square = squaredDistances(mask, 1);
  Mask out{mask.dims, mask.spacing_mm, std::vector<std::uint8_t>(mask.set.size())};
  const double limit = radius_mm * radius_mm;
  for (std::size_t v = 0; v < square.size(); ++v) out.set[v] = square[v] <= limit ? 1 : 0;
  return out;
}

Mask eroded(const Mask& mask, double radius_mm) {
  const std::vector<float> square = squaredDistances(mask, 0);
  Mask out{mask.dims, mask.spacing_mm, std::vector<std::uint8_t>(mask.set.size())};
  const double limit = radius_mm * radius_mm;
  for (std::size_t v = 0; v < square.size(); ++v) out.set[v] = square[v] > limit ? 1 : 0;
  return out;
}

}  // namespace spinaltap::segment
