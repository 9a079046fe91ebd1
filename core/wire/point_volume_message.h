// core/wire/point_volume_message.h - a point volume as bytes ('STP1'). Layout: server/contract/haptics.md, "Bodies".
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/point_volume/point_volume.h"

namespace spinaltap::wire {

inline constexpr std::uint32_t kPointVolumeMagic = 0x31505453;  ///< the bytes 'S' 'T' 'P' '1'

/// @pre alive and density have the lengths that the lattice asks for.
[[nodiscard]] std::vector<std::byte> encodePointVolume(const point_volume::PointVolume& volume);

/// @error Corrupt (magic, lengths, alive bits past the last point), Unsupported (version), and those of checkLattice.
///        Nothing is allocated before the lengths are known to fit the bytes at hand.
[[nodiscard]] Result<point_volume::PointVolume> decodePointVolume(std::span<const std::byte> bytes);

}  // namespace spinaltap::wire
