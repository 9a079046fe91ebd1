// server/store/rows.h - grids, paths and lattices as JSON, in rows and in answers alike.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "core/base/frame.h"
#include "core/plan/path.h"
#include "core/point_volume/lattice.h"
#include "core/volume/grid.h"

namespace spinaltap::store {

[[nodiscard]] nlohmann::json toJson(const Vec3& v);
[[nodiscard]] nlohmann::json toJson(const volume::Grid& grid);
[[nodiscard]] nlohmann::json toJson(const plan::Bit& bit);
[[nodiscard]] nlohmann::json toJson(const point_volume::Lattice& lattice);

/// Throw nlohmann::json::exception when a key is missing or of another type.
[[nodiscard]] Vec3 vec3From(const nlohmann::json& json);
[[nodiscard]] volume::Grid gridFrom(const nlohmann::json& json);
[[nodiscard]] plan::Bit bitFrom(const nlohmann::json& json);
[[nodiscard]] point_volume::Lattice latticeFrom(const nlohmann::json& json);

}  // namespace spinaltap::store
