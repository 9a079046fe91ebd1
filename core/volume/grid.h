// core/volume/grid.h - a CT grid in the patient's space, its HU, and labels on it.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/result.h"
#include "core/base/vec3.h"

namespace spinaltap::volume {

/// Voxel (i, j, k) has its centre at origin_patient + direction * (i*spacing.x, j*spacing.y, k*spacing.z).
/// Oblique and anisotropic stacks are normal; direction is orthonormal and right-handed.
struct Grid {
  std::array<int, 3> dims{0, 0, 0};  ///< voxels along i (fastest), j, k
  Vec3 spacing_mm{1, 1, 1};
  Vec3 origin_patient;  ///< centre of voxel (0, 0, 0), mm, DICOM LPS
  Mat3 direction;       ///< columns: unit vectors of i, j, k in LPS

  [[nodiscard]] std::size_t voxels() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
  }
  /// @pre the indices lie in the grid.
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(dims[0]) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(k));
  }
  [[nodiscard]] bool contains(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < dims[0] && j < dims[1] && k < dims[2];
  }
  /// Continuous voxel coordinates to mm and back.
  [[nodiscard]] Vec3 toPatient(const Vec3& voxel) const;
  [[nodiscard]] Vec3 toVoxel(const Vec3& patient) const;
  friend bool operator==(const Grid&, const Grid&) = default;
};

/// @error InvalidArgument (dims, spacing, direction not orthonormal to 1e-4), NotFinite, Limit (over 2^31 voxels).
[[nodiscard]] Result<void> checkGrid(const Grid& grid);

struct CtVolume {
  Grid grid;
  std::vector<std::int16_t> hu;  ///< #voxels
};

/// One structure: 1 inside, 0 outside.
struct LabelVolume {
  Grid grid;
  std::vector<std::uint8_t> inside;  ///< #voxels
};

}  // namespace spinaltap::volume
