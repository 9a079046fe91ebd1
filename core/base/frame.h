// core/base/frame.h - a rigid frame in the patient's space.
#pragma once
#include "core/base/vec3.h"

namespace spinaltap {

/// A right-handed orthonormal frame: `origin` and the three axes (columns of `axes`), given in the
/// patient frame (DICOM LPS, mm). Local coordinates stay small however far away the scanner put its origin.
struct Frame {
  Vec3 origin_patient;
  Mat3 axes;

  [[nodiscard]] Vec3 toLocal(const Vec3& patient) const { return transposeTimes(axes, patient - origin_patient); }
  [[nodiscard]] Vec3 toPatient(const Vec3& local) const { return origin_patient + axes * local; }
  [[nodiscard]] Vec3 directionToLocal(const Vec3& patient) const { return transposeTimes(axes, patient); }
  [[nodiscard]] Vec3 directionToPatient(const Vec3& local) const { return axes * local; }
};

}  // namespace spinaltap
