// core/phantom/tissue.h - the HU of every tissue in and around the vertebra, without noise or blur.
// cortical 600-1200; cancellous 140-230 (osteoporotic 60-90), denser near the endplates; muscle and vessels 40-60;
// fat about -95; canal about 30; discs about 80; air -1000 outside the skin.
#pragma once
#include <cstdint>

#include "core/phantom/anatomy.h"

namespace spinaltap::phantom {

struct Tissue {
  std::uint64_t seed = 1;
  bool osteoporotic = false;

  /// HU inside bone. @param depth_mm  how deep under the surface: -boneDistance.
  [[nodiscard]] double boneHu(const Anatomy& anatomy, const Vec3& local, double depth_mm) const;
  /// HU of what surrounds the bone; defined everywhere, as if the bone were not there.
  [[nodiscard]] double softHu(const Anatomy& anatomy, const Vec3& local) const;
  /// Thickness of the cortex: about 1 mm on the body, half as much again on pedicles and arch; half of it when
  /// osteoporotic.
  [[nodiscard]] double shellThickness(const Vec3& local) const;
};

}  // namespace spinaltap::phantom
