// server/import/child/label.h - one value of a label image on the CT's grid.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/volume/grid.h"
#include "server/import/child/input_files.h"

namespace spinaltap::importer {

/// 1 where the label image has `value`. The image must hold the same voxels as `ct`; the order and sense of its axes
/// may differ. @error Unsupported (other voxels, no whole numbers), NotFound (no such value: lists those there are),
/// Corrupt.
[[nodiscard]] Result<std::vector<std::uint8_t>> loadLabel(const InputFile& file, int value, const volume::Grid& ct,
                                                          std::uint64_t voxel_limit);

}  // namespace spinaltap::importer
