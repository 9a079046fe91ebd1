// server/import/child/stack.h - puts slices in order and decides whether they are one volume. Knows no file format.
#pragma once
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/volume/grid.h"
#include "server/import/child/slice.h"

namespace spinaltap::importer {

/// How far geometry may be from a perfect lattice. The drill's points are 0.1 mm apart, so half of that is where a
/// displaced voxel would begin to move bone from one point to the next.
inline constexpr double kPositionTolerance_mm = 0.05;
/// And a fiftieth of the step, so that thin slices are held tighter; real tables and printed decimals stay below it.
inline constexpr double kStepTolerance = 0.02;
/// Directions printed with four decimals are off by 5e-5 a component: dot products by at most 2 * sqrt(3) * 5e-5.
inline constexpr double kDirectionTolerance = 2e-4;

struct StackOptions {
  bool allow_single_slice = false;
  std::uint64_t voxels = 0;
};

struct Stack {
  volume::Grid grid;
  std::vector<std::size_t> order;  ///< indices into the slices, from k = 0
  std::vector<std::string> notes;
};

/// Sorts along the slice normal; k grows along row x column, so that the grid is right-handed.
/// @error One line that names the slice and the position: mixed size, spacing, orientation or frame of reference,
///        duplicate or missing slices, irregular steps, a sheared stack, one slice, too many voxels.
[[nodiscard]] Result<Stack> arrangeStack(const std::vector<Slice>& slices, const StackOptions& options);

/// "12.5", "-3": at most three decimals.
[[nodiscard]] std::string millimetres(double value);

}  // namespace spinaltap::importer
