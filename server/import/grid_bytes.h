// server/import/grid_bytes.h - a grid as bytes: between the importer's child and the program, and in stored labels.
#pragma once
#include "core/volume/grid.h"
#include "core/wire/bytes.h"

namespace spinaltap::importer {

/// 3 i32 dims, then spacing, origin and the direction's three columns as 3 f64 each.
inline void writeGrid(wire::ByteWriter& out, const volume::Grid& grid) {
  for (const int dim : grid.dims) out.i32(dim);
  out.vec3(grid.spacing_mm);
  out.vec3(grid.origin_patient);
  out.vec3(grid.direction.col_x);
  out.vec3(grid.direction.col_y);
  out.vec3(grid.direction.col_z);
}

/// What was read is not checked: see in.failed() and volume::checkGrid.
[[nodiscard]] inline volume::Grid readGrid(wire::ByteReader& in) {
  volume::Grid grid;
  for (int& dim : grid.dims) dim = in.i32();
  grid.spacing_mm = in.vec3();
  grid.origin_patient = in.vec3();
  grid.direction.col_x = in.vec3();
  grid.direction.col_y = in.vec3();
  grid.direction.col_z = in.vec3();
  return grid;
}

}  // namespace spinaltap::importer
