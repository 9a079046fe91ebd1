// core/plan/path.h - a planned hole: entry, target, bit, and the cylinder of bone that is modelled around it.
#pragma once
#include "core/base/frame.h"
#include "core/base/result.h"

namespace spinaltap::plan {

/// A cylinder with a conical tip. The tip's apex is the bit's origin.
struct Bit {
  double diameter_mm = 3.0;
  double cone_length_mm = 5.0;  ///< apex to where the cone meets the cylinder; 0 is a flat end
  double length_mm = 50.0;      ///< apex to the end of what is tested against bone; at least cone_length_mm
  friend bool operator==(const Bit&, const Bit&) = default;
};

/// @error InvalidArgument, NotFinite. Diameter 0.5-8 mm, length up to 200 mm.
[[nodiscard]] Result<void> checkBit(const Bit& bit);

struct Path {
  Vec3 entry_patient;   ///< mm, LPS, on the bone's surface
  Vec3 target_patient;  ///< mm, LPS, where the tip shall end
  Bit bit;
  double volume_radius_mm = 4.0;  ///< of the modelled cylinder, around the path
  double lead_mm = 0;             ///< how far the modelled cylinder begins before the entry point
  double spacing_mm = 0.1;        ///< between discs, and between rings
};

/// @error Degenerate (entry equals target, or path shorter than a spacing), NotFinite,
///        InvalidArgument (bit wider than the volume, spacing out of 0.01-1 mm), Limit (over 2^31 points).
[[nodiscard]] Result<void> checkPath(const Path& path);

/// Origin at the entry point, z from entry to target; x is the patient axis least along z, made perpendicular.
/// @pre checkPath(path).
[[nodiscard]] Frame pathFrame(const Path& path);

[[nodiscard]] double length(const Path& path);

}  // namespace spinaltap::plan
