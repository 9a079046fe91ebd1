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
/// The CT around the vertebra.
[[nodiscard]] Result<volume::CtVolume> loadRoi(store::Store& store, const store::Case& row);
[[nodiscard]] Result<mesh::TriangleMesh> loadMesh(store::Store& store, const store::Case& row);
[[nodiscard]] Result<rbf::Model> loadModel(store::Store& store, const store::Case& row);
[[nodiscard]] Result<point_volume::PointVolume> loadPointVolume(store::Store& store, const store::Path& row);

/// What a user may call a case or a path: up to 100 bytes without control characters. @error InvalidArgument.
[[nodiscard]] Result<void> checkLabelText(const std::string& text);

}  // namespace spinaltap::jobs
