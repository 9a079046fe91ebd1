// core/segment/isolate.h - one vertebra out of a CT with neighbours, from one click.
//
// From a place in the wanted vertebral body the plates and walls of that body are found, then its neighbours' bodies
// and the canal. Bodies, and what of their arches is sure, seed a competition in which each vertebra floods the bone at
// a cost that dark voxels and joint spaces raise; what the wanted one wins is bounded on the CT's own grid and filled.
#pragma once
#include <functional>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/volume/grid.h"

namespace spinaltap::segment {

struct IsolateOptions {
  Vec3 seed_patient;        ///< mm; in the wanted vertebral body, within some 8 mm of its middle
  double threshold_hu = 0;  ///< bone is above it; 0: measured on the body's wall
  unsigned threads = 0;     ///< 0: as many as the machine runs; the result is the same from any number
};

struct Neighbour {
  Vec3 body_middle_patient;
  bool above = false;
};

struct Isolated {
  volume::LabelVolume label;  ///< on the CT's grid
  double threshold_hu = 0;    ///< as given or measured
  Vec3 body_middle_patient;
  Vec3 body_up_patient;  ///< unit, along the body's axis, towards the head
  double body_height_mm = 0;
  std::vector<Neighbour> neighbours;  ///< those found, above first
};

/// Called as work goes on: "body", "neighbours", "compete", "edge", each with the part of all work done before it.
using IsolateProgress = std::function<void(std::string_view stage, double done)>;

/// Which voxels of the CT belong to the vertebra whose body holds the seed. Marrow is filled; canal and foramina are
/// open; one island. A vertebra that the scan cuts off is returned as far as it was scanned.
/// @pre    patient coordinates are LPS: the search takes y for the back and z for the head, within 35 degrees.
/// @error  InvalidArgument (seed outside the volume, values do not fit the grid, a threshold out of range), NotFinite,
///         Degenerate (a volume thinner than 20 mm along one of its axes: no body can be told from it), NotFound (no
///         vertebral body at the seed; the message gives the HU there).
/// @cost   1 to 2 s of CPU and 100 MB round the seed, however large the volume; linear in the vertebra's voxels.
[[nodiscard]] Result<Isolated> isolate(const volume::CtVolume& ct, const IsolateOptions& options,
                                       const IsolateProgress& progress = {});

}  // namespace spinaltap::segment
