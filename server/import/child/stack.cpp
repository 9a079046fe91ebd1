#include "server/import/child/stack.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

namespace spinaltap::importer {

namespace {

/// Slices with their distance along the normal, in order.
struct Placed {
  std::size_t slice;
  double along_mm;
};

Result<void> checkAlike(const Slice& first, const Slice& other) {
  const auto differs = [&](const std::string& what) {
    return fail(ErrorCode::Unsupported, other.name + ": its " + what + " differs from that of " + first.name);
  };
  const auto apart = [](double a, double b) { return std::abs(a - b) > 1e-4 * std::abs(a); };
  if (first.pixels.rows != other.pixels.rows || first.pixels.columns != other.pixels.columns) return differs("size");
  if (apart(first.row_spacing_mm, other.row_spacing_mm) || apart(first.column_spacing_mm, other.column_spacing_mm)) {
    return differs("pixel spacing");
  }
  if (norm(first.row_direction - other.row_direction) > kDirectionTolerance ||
      norm(first.column_direction - other.column_direction) > kDirectionTolerance) {
    return differs("orientation");
  }
  if (first.frame_of_reference != other.frame_of_reference) return differs("frame of reference");
  return {};
}

Result<void> checkAllAlike(const std::vector<Slice>& slices) {
  std::set<std::pair<std::string, int>> seen;
  for (const Slice& slice : slices) {
    if (auto alike = checkAlike(slices.front(), slice); !alike) return alike;
    if (!slice.sop_instance.empty() && !seen.emplace(slice.sop_instance, slice.frame).second) {
      return fail(ErrorCode::Unsupported, slice.name + ": its SOPInstanceUID is that of another slice");
    }
  }
  return {};
}

std::vector<Placed> sortAlong(const std::vector<Slice>& slices, const Vec3& normal) {
  std::vector<Placed> placed;
  placed.reserve(slices.size());
  for (std::size_t i = 0; i < slices.size(); ++i) {
    placed.push_back({i, dot(slices[i].position_patient - slices.front().position_patient, normal)});
  }
  std::sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    return a.along_mm != b.along_mm ? a.along_mm < b.along_mm : a.slice < b.slice;
  });
  return placed;
}

double medianStep(const std::vector<Placed>& placed) {
  std::vector<double> steps;
  steps.reserve(placed.size());
  for (std::size_t k = 1; k < placed.size(); ++k) steps.push_back(placed[k].along_mm - placed[k - 1].along_mm);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

std::string between(const Slice& a, const Slice& b) { return " between " + a.name + " and " + b.name; }

Result<void> checkSteps(const std::vector<Slice>& slices, const std::vector<Placed>& placed) {
  const double step = medianStep(placed);
  for (std::size_t k = 1; k < placed.size(); ++k) {
    const Slice &a = slices[placed[k - 1].slice], &b = slices[placed[k].slice];
    const double gap = placed[k].along_mm - placed[k - 1].along_mm;
    if (gap < 1e-3) {
      return fail(ErrorCode::Unsupported, b.name + ": duplicate slice, at the position of " + a.name);
    }
    // The jitter of both ends counts.
    const double tolerance = 2 * std::min(kPositionTolerance_mm, kStepTolerance * step);
    if (std::abs(gap - step) <= tolerance) continue;
    const double steps = gap / step;
    const double missing = std::round(steps) - 1;
    if (missing >= 1 && std::abs(steps - std::round(steps)) < 0.05) {
      return fail(ErrorCode::Unsupported, std::to_string(static_cast<long>(missing)) + " missing slice(s)" +
                                              between(a, b) + ": a gap of " + millimetres(gap) +
                                              " mm where others are " + millimetres(step) + " mm");
    }
    return fail(ErrorCode::Unsupported, "irregular slice spacing" + between(a, b) + ": " + millimetres(gap) +
                                            " mm where others are " + millimetres(step) + " mm");
  }
  return {};
}

/// Every slice near its place on the straight, evenly divided line from the first to the last.
Result<void> checkLattice(const std::vector<Slice>& slices, const std::vector<Placed>& placed, const Vec3& normal,
                          double step) {
  const Slice& first = slices[placed.front().slice];
  const Slice& last = slices[placed.back().slice];
  const auto lateral = [&](const Slice& slice) {
    const Vec3 offset = slice.position_patient - first.position_patient;
    return norm(offset - normal * dot(offset, normal));
  };
  for (std::size_t k = 0; k < placed.size(); ++k) {
    const Slice& slice = slices[placed[k].slice];
    if (lateral(slice) > kPositionTolerance_mm) {
      const double angle = std::atan2(lateral(last), dot(last.position_patient - first.position_patient, normal));
      return fail(ErrorCode::Unsupported,
                  slice.name + ": the stack is sheared (gantry tilt or drift): the slices step " +
                      millimetres(angle * 180 / 3.14159265358979323846) + " degrees off their normal");
    }
    const double ideal = placed.front().along_mm + static_cast<double>(k) * step;
    const double off = std::abs(placed[k].along_mm - ideal);
    if (off > std::min(kPositionTolerance_mm, kStepTolerance * step)) {
      return fail(ErrorCode::Unsupported,
                  "irregular slice spacing: " + slice.name + " is " + millimetres(off) + " mm off its place");
    }
  }
  return {};
}

Result<void> checkSize(const Slice& first, std::size_t count, std::uint64_t limit) {
  const std::uint64_t voxels = static_cast<std::uint64_t>(first.pixels.rows) *
                               static_cast<std::uint64_t>(first.pixels.columns) * static_cast<std::uint64_t>(count);
  if (voxels > limit) {
    return fail(ErrorCode::Limit, first.name + ": " + std::to_string(first.pixels.columns) + " x " +
                                      std::to_string(first.pixels.rows) + " x " + std::to_string(count) +
                                      " voxels are over the limit");
  }
  return {};
}

volume::Grid gridOf(const Slice& first, std::size_t count, double step) {
  volume::Grid grid;
  grid.dims = {first.pixels.columns, first.pixels.rows, static_cast<int>(count)};
  grid.spacing_mm = {first.column_spacing_mm, first.row_spacing_mm, step};
  grid.origin_patient = first.position_patient;
  const Vec3 i = normalized(first.row_direction);
  const Vec3 k = normalized(cross(i, first.column_direction));
  grid.direction = {i, cross(k, i), k};
  return grid;
}

Result<Stack> singleSlice(const Slice& slice, const StackOptions& options) {
  if (!options.allow_single_slice) {
    return fail(ErrorCode::Unsupported, slice.name + ": a single slice is not a volume");
  }
  Stack stack;
  stack.order = {0};
  stack.grid = gridOf(slice, 1, slice.thickness_mm.value_or(1.0));
  return stack;
}

}  // namespace

std::string millimetres(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3f", value);
  std::string line(text);
  while (line.back() == '0') line.pop_back();
  if (line.back() == '.') line.pop_back();
  return line == "-0" ? "0" : line;
}

Result<Stack> arrangeStack(const std::vector<Slice>& slices, const StackOptions& options) {
  if (slices.empty()) return fail(ErrorCode::Unsupported, "no slices");
  if (auto fits = checkSize(slices.front(), slices.size(), options.voxels); !fits) return tl::unexpected(fits.error());
  if (auto alike = checkAllAlike(slices); !alike) return tl::unexpected(alike.error());
  if (slices.size() == 1) return singleSlice(slices.front(), options);

  const Vec3 normal = normalized(cross(slices.front().row_direction, slices.front().column_direction));
  const std::vector<Placed> placed = sortAlong(slices, normal);
  if (auto even = checkSteps(slices, placed); !even) return tl::unexpected(even.error());
  const double step = (placed.back().along_mm - placed.front().along_mm) / static_cast<double>(placed.size() - 1);
  if (auto straight = checkLattice(slices, placed, normal, step); !straight) return tl::unexpected(straight.error());

  Stack stack;
  stack.order.reserve(placed.size());
  for (const Placed& p : placed) stack.order.push_back(p.slice);
  stack.grid = gridOf(slices[stack.order.front()], slices.size(), step);
  return stack;
}

}  // namespace spinaltap::importer
