// core/wire/volume_message.h - a CT grid and its HU as bytes ('STV1'). Layout: server/contract/haptics.md, "Bodies".
// Plain fields rather than volume::CtVolume: wire does not know the module volume.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/base/vec3.h"

namespace spinaltap::wire {

inline constexpr std::uint32_t kVolumeMagic = 0x31565453;  ///< the bytes 'S' 'T' 'V' '1'

/// As volume::Grid: voxel (i, j, k) lies at origin + direction * (i*spacing.x, j*spacing.y, k*spacing.z).
struct VolumeGrid {
  std::array<int, 3> dims{0, 0, 0};
  Vec3 spacing_mm{1, 1, 1};
  Vec3 origin_patient;
  Mat3 direction;
  friend bool operator==(const VolumeGrid&, const VolumeGrid&) = default;
};

struct VolumeMessage {
  VolumeGrid grid;
  std::vector<std::int16_t> hu;  ///< i fastest, then j, then k
};

/// @pre hu.size() is the product of dims.
[[nodiscard]] std::vector<std::byte> encodeVolume(const VolumeGrid& grid, std::span<const std::int16_t> hu);

/// @error Corrupt (magic, dims that are not positive or do not match the length, numbers that are not finite, spacing
/// not
///        above zero), Unsupported (version). Whether direction is a rotation is for the reader to check.
[[nodiscard]] Result<VolumeMessage> decodeVolume(std::span<const std::byte> bytes);

}  // namespace spinaltap::wire
