// core/segment/body.h - a vertebral body seen from inside: its end plates, its outline, the canal behind it (internal
// to segment). Everything is found from edges, which need no threshold; the bone's threshold is then measured on them.
#pragma once
#include <array>
#include <optional>

#include "core/base/frame.h"
#include "core/segment/scene.h"

namespace spinaltap::segment {

/// Where a body ends towards a disc, in mm from the seed.
struct EndPlate {
  Vec3 middle;
  Vec3 up{0, 0, 1};    ///< unit, at right angles to the plate, towards the head
  double edge_hu = 0;  ///< mean drop in HU from the plate to the disc; 0 where the scan ends instead
};

inline constexpr int kOutlineRays = 72;
inline constexpr int kOutlineLevels = 7;
using Outline = std::array<double, kOutlineRays>;

/// Level n lies at this part of the way from the bottom plate to the top plate.
[[nodiscard]] inline constexpr double partOfLevel(int n) { return 0.08 + 0.14 * n; }

struct Body {
  EndPlate top, bottom;
  /// Origin midway between the plates; x left, y back, z up along the body's own axis.
  Frame frame;
  double height_mm = 0;
  /// From the axis to the wall below the pedicles, every 360 / kOutlineRays degrees from left over back.
  Outline outline_mm{};
  /// The same at each level: a body is waisted, and its rims flare beyond the waist by up to a fifth of its width.
  std::array<Outline, kOutlineLevels> level_mm{};
  double half_width_mm = 0;   ///< left to right
  double back_mm = 0;         ///< from the axis to the wall before the canal
  double soft_hu = 0;         ///< beside the wall
  double wall_hu = 0;         ///< of the wall
  std::optional<Vec3> canal;  ///< its middle at the height of the pedicles
  double score = 0;           ///< HU; how sure it is (BodyBox::score)
};

/// How deep a place lies in the column that the outline makes between the plates, mm; negative outside.
struct ColumnDepth {
  double of_wall, of_plates;
  [[nodiscard]] double least() const { return of_wall < of_plates ? of_wall : of_plates; }
};

/// @param local  in the body's frame.
[[nodiscard]] ColumnDepth depthIn(const Body& body, const Vec3& local);

/// @param inside  a place in the body, within some 8 mm of its axis and 8 mm of its middle height.
/// @return nothing when there is no such body: no plates that face each other, no wall, all too faint or too small.
[[nodiscard]] std::optional<Body> findBody(const Scene& scene, const Vec3& inside, const Vec3& up);

}  // namespace spinaltap::segment
