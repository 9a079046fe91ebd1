// server/jobs/case_files.h - a case's blobs, decoded.
#pragma once
#include <string>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/point_volume/point_volume.h"
#include "server/jobs/codec.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

/// @error NotFound, naming the job that has to come first; Corrupt, Io.
[[nodiscard]] Result<volume::CtVolume> loadCt(store::Store& store, const store::Case& row);
[[nodiscard]] Result<volume::LabelVolume> loadLabel(store::Store& store, const store::Case& row);
/// What reconstruct kept of the CT: that of a Region.
[[nodiscard]] Result<volume::CtVolume> loadRoi(store::Store& store, const store::Case& row);
[[nodiscard]] Result<mesh::TriangleMesh> loadMesh(store::Store& store, const store::Case& row);
[[nodiscard]] Result<rbf::Model> loadModel(store::Store& store, const store::Case& row);
[[nodiscard]] Result<point_volume::PointVolume> loadPointVolume(store::Store& store, const store::Path& row);

/// The vertebra's surroundings: the box of its label and kRoiMargin_mm around it.
struct Region {
  volume::CtVolume ct;
  volume::LabelVolume label;
};
inline constexpr double kRoiMargin_mm = 15;

/// Cut out of the case's CT and label. @error as loadCt and loadLabel; NotFound when the label is empty.
[[nodiscard]] Result<Region> loadRegion(store::Store& store, const store::Case& row);

/// What a user may call a case or a path: up to 100 bytes without control characters. @error InvalidArgument.
[[nodiscard]] Result<void> checkLabelText(const std::string& text);

}  // namespace spinaltap::jobs
