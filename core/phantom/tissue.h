// core/phantom/tissue.h - the HU of every tissue in and around the vertebra.
// Ranges: cortical 600-1200, cancellous 140-230 (osteoporotic 60-90), muscle 40-60, fat -90, canal 30, disc 80, air
// -1000.
#pragma once
#include <cstdint>

#include "core/phantom/anatomy.h"

namespace spinaltap::phantom {

struct Tissue {
  std::uint64_t seed = 1;
  double shell_mm = 1.0;  ///< cortex of the body; the arch's is thicker
  double cortical_hu = 950, cancellous_low_hu = 150, cancellous_high_hu = 215;

  [[nodiscard]] static Tissue make(std::uint64_t seed, bool osteoporotic);

  /// HU at a place in the vertebra's frame, given its boneDistance there.
  [[nodiscard]] double hu(const Anatomy& anatomy, const Vec3& local, double bone_distance) const;
};

}  // namespace spinaltap::phantom
