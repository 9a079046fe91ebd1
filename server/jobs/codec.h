// server/jobs/codec.h - volumes, labels and models as blobs, and back.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/rbf/rbf.h"
#include "core/volume/grid.h"

namespace spinaltap::jobs {

/// 'STV1', as core/wire/volume_message.h.
[[nodiscard]] std::vector<std::byte> encodeCt(const volume::CtVolume& ct);
[[nodiscard]] Result<volume::CtVolume> decodeCt(std::span<const std::byte> bytes);

/// 'STL1': u32 magic, u32 version = 1, grid as in STV1, u32 runs, then the runs' lengths as u32, the first one outside.
[[nodiscard]] std::vector<std::byte> encodeLabel(const volume::LabelVolume& label);
[[nodiscard]] Result<volume::LabelVolume> decodeLabel(std::span<const std::byte> bytes);

/// 'STF1': u32 magic, u32 version = 2, f64 x 3 centroid, f64 radius, f64 constant, f64 x 3 linear, u32 centres, then
/// for each f64 x 3 centre and f64 weight. The doubles keep their bits. Version 1 had no radius: it is read with none.
[[nodiscard]] std::vector<std::byte> encodeModel(const rbf::Model& model);
[[nodiscard]] Result<rbf::Model> decodeModel(std::span<const std::byte> bytes);

/// No two values of the model differ by more than this times their distance: |c| + sum |w|, since every kernel has
/// slope 1.
[[nodiscard]] double lipschitzOf(const rbf::Model& model);

}  // namespace spinaltap::jobs
