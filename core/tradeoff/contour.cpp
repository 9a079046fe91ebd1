#include "core/tradeoff/contour.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

namespace spinaltap::tradeoff {
namespace {

/// An edge of the sheet: 2 * corner + (0 along right, 1 along down).
using Edge = std::uint64_t;

struct Segments {
  const Sheet& sheet;
  std::map<Edge, std::array<std::int64_t, 2>> of;  ///< edge -> the one or two edges it is joined to, -1 for none

  [[nodiscard]] double at(std::size_t i, std::size_t j) const { return sheet.values[j * (sheet.nx + 1) + i]; }
  [[nodiscard]] bool inside(std::size_t i, std::size_t j) const { return at(i, j) < 0; }

  void join(Edge a, Edge b) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
      auto& ends = of.try_emplace(from, std::array<std::int64_t, 2>{-1, -1}).first->second;
      ends[ends[0] < 0 ? 0 : 1] = static_cast<std::int64_t>(to);
    }
  }

  /// The edges that the zero set crosses, joined in pairs; of the two ways through a saddle, the inside corners are
  /// kept apart.
  void addSquare(std::size_t i, std::size_t j) {
    const auto edge = [&](std::size_t a, std::size_t b, std::uint64_t axis) {
      return 2 * (static_cast<Edge>(b) * (sheet.nx + 1) + a) + axis;
    };
    const Edge top = edge(i, j, 0), bottom = edge(i, j + 1, 0), left = edge(i, j, 1), right = edge(i + 1, j, 1);
    const bool a = inside(i, j), b = inside(i + 1, j), c = inside(i + 1, j + 1), d = inside(i, j + 1);
    if (a == c && b == d && a != b) {
      if (a) return join(top, left), join(right, bottom);
      return join(top, right), join(left, bottom);
    }
    std::array<Edge, 4> crossed{};
    std::size_t count = 0;
    if (a != b) crossed[count++] = top;
    if (b != c) crossed[count++] = right;
    if (c != d) crossed[count++] = bottom;
    if (d != a) crossed[count++] = left;
    if (count == 2) join(crossed[0], crossed[1]);
  }

  [[nodiscard]] std::array<double, 2> placeOf(Edge e) const {
    const std::size_t corner = static_cast<std::size_t>(e / 2), i = corner % (sheet.nx + 1),
                      j = corner / (sheet.nx + 1);
    const bool down = e % 2 == 1;
    const double here = at(i, j), there = down ? at(i, j + 1) : at(i + 1, j);
    const double part = here / (here - there);
    return {(static_cast<double>(i) + (down ? 0 : part)) * sheet.step_mm,
            (static_cast<double>(j) + (down ? part : 0)) * sheet.step_mm};
  }

  /// The line from `start` on, its edges taken out.
  Polyline walk(Edge start) {
    Polyline line;
    std::int64_t last = -1, at = static_cast<std::int64_t>(start);
    while (at >= 0) {
      line.push_back(placeOf(static_cast<Edge>(at)));
      const auto found = of.find(static_cast<Edge>(at));
      if (found == of.end()) break;  // round again: the first edge is gone, and was just added once more
      const auto ends = found->second;
      of.erase(found);
      const std::int64_t next = ends[0] != last ? ends[0] : ends[1];
      last = at, at = next;
    }
    return line;
  }
};

constexpr std::size_t kFine = 4;  // shadow cells along a square's side

struct Place2 {
  double x, y;
};

/// Which cells of a finer sheet have their middle in the shadow.
class Shadow {
 public:
  Shadow(std::size_t nx, std::size_t ny, double cell_mm) : nx_(nx), ny_(ny), cell_mm_(cell_mm), dark_(nx * ny, 0) {}

  void add(const Place2& a, const Place2& b, const Place2& c) {
    const auto [first, last] = between({a.y, b.y, c.y}, ny_);
    for (std::size_t j = first; j < last; ++j) {
      const double y = (static_cast<double>(j) + 0.5) * cell_mm_;
      // Where the row's line enters and leaves the triangle.
      double low = 1e300, high = -1e300;
      for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
        if ((p.y < y) == (q.y < y)) continue;
        const double x = p.x + (q.x - p.x) * (y - p.y) / (q.y - p.y);
        low = std::min(low, x), high = std::max(high, x);
      }
      const auto [from, to] = between({low, high, high}, nx_);
      for (std::size_t i = from; i < to; ++i) dark_[j * nx_ + i] = 1;
    }
  }

  [[nodiscard]] bool dark(std::size_t i, std::size_t j) const { return i < nx_ && j < ny_ && dark_[j * nx_ + i] != 0; }

 private:
  /// The cells whose middles lie from the least to the greatest.
  [[nodiscard]] std::pair<std::size_t, std::size_t> between(const std::array<double, 3>& at, std::size_t count) const {
    const auto cell = [&](double mm) {
      return static_cast<std::size_t>(std::clamp(std::ceil(mm / cell_mm_ - 0.5), 0.0, static_cast<double>(count)));
    };
    return {cell(*std::min_element(at.begin(), at.end())), cell(*std::max_element(at.begin(), at.end()))};
  }

  std::size_t nx_, ny_;
  double cell_mm_;
  std::vector<std::uint8_t> dark_;
};

Sheet emptySheet(const Plane& plane, double step_mm) {
  Sheet sheet{static_cast<std::size_t>(plane.width_mm / step_mm),
              static_cast<std::size_t>(plane.height_mm / step_mm),
              step_mm,
              {}};
  sheet.values.reserve((sheet.nx + 1) * (sheet.ny + 1));
  return sheet;
}

/// Half less the share of the square around the corner that is dark.
double lightAt(const Shadow& shadow, std::size_t i, std::size_t j) {
  std::size_t dark = 0;
  // The corner lies between the cells kFine * i - 1 and kFine * i; unsigned wrap-around below zero is out of range.
  for (std::size_t b = 0; b < kFine; ++b)
    for (std::size_t a = 0; a < kFine; ++a)
      dark += shadow.dark(kFine * i + a - kFine / 2, kFine * j + b - kFine / 2) ? 1 : 0;
  return 0.5 - static_cast<double>(dark) / (kFine * kFine);
}

}  // namespace

std::vector<Polyline> linesOf(const Sheet& sheet) {
  Segments segments{sheet, {}};
  for (std::size_t j = 0; j < sheet.ny; ++j)
    for (std::size_t i = 0; i < sheet.nx; ++i) segments.addSquare(i, j);
  std::vector<Polyline> out;
  // Open lines first, from their ends; what is left runs in rings.
  std::vector<Edge> ends;
  for (const auto& [edge, joined] : segments.of) {
    if (joined[1] < 0) ends.push_back(edge);
  }
  for (const Edge end : ends) {
    if (segments.of.count(end) != 0) out.push_back(segments.walk(end));
  }
  while (!segments.of.empty()) out.push_back(segments.walk(segments.of.begin()->first));
  return out;
}

std::vector<Polyline> contourOf(const Field& field, const Plane& plane, double step_mm) {
  Sheet sheet = emptySheet(plane, step_mm);
  std::vector<Vec3> points;
  for (std::size_t j = 0; j <= sheet.ny; ++j) {
    for (std::size_t i = 0; i <= sheet.nx; ++i) {
      points.push_back(plane.origin_patient + plane.right * (static_cast<double>(i) * step_mm) +
                       plane.down * (static_cast<double>(j) * step_mm));
    }
  }
  sheet.values.resize(points.size());
  field.values(points, sheet.values);
  return linesOf(sheet);
}

std::vector<Polyline> silhouetteOf(const mesh::TriangleMesh& mesh, const Plane& plane, double step_mm) {
  Sheet sheet = emptySheet(plane, step_mm);
  Shadow shadow(kFine * sheet.nx, kFine * sheet.ny, step_mm / kFine);
  const auto flat = [&](std::uint32_t vertex) {
    const Vec3 p = mesh.vertices[vertex] - plane.origin_patient;
    return Place2{dot(p, plane.right), dot(p, plane.down)};
  };
  for (const auto& t : mesh.triangles) shadow.add(flat(t[0]), flat(t[1]), flat(t[2]));
  for (std::size_t j = 0; j <= sheet.ny; ++j)
    for (std::size_t i = 0; i <= sheet.nx; ++i) sheet.values.push_back(lightAt(shadow, i, j));
  return linesOf(sheet);
}

}  // namespace spinaltap::tradeoff
