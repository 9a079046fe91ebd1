// tests/core/point_volume/random_place.h - a lattice somewhere in a patient, any way round; shared by the tests beside
// it.
#pragma once
#include "core/base/random.h"
#include "core/plan/path.h"
#include "core/point_volume/lattice.h"

namespace spinaltap::point_volume {

struct Place {
  Lattice lattice;
  Frame frame;
};

/// Spacing from `finest_mm` to `coarsest_mm`, 1 to `most_rings` rings, 1 to `most_discs` discs; up to half a metre from
/// the patient's origin along each axis.
inline Place randomPlace(Random& random, double finest_mm, double coarsest_mm, unsigned most_rings,
                         unsigned most_discs) {
  Place place;
  place.lattice = {random.uniform(finest_mm, coarsest_mm), 1 + static_cast<int>(random.below(most_rings)),
                   1 + static_cast<int>(random.below(most_discs)), static_cast<int>(random.below(20)) - 10};
  plan::Path path;
  path.entry_patient = {random.uniform(-500, 500), random.uniform(-500, 500), random.uniform(-500, 500)};
  path.target_patient = path.entry_patient + Vec3{random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(1, 9)};
  place.frame = plan::pathFrame(path);
  return place;
}

}  // namespace spinaltap::point_volume
