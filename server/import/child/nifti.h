// server/import/child/nifti.h - NIfTI-1 and NIfTI-2 single files, plain or gzipped, from memory.
// The structs are those of libnifti2's headers; its reader opens files by name, which the sandbox forbids, so the bytes
// are read here, field by field. Specification: nifti1.h and nifti2.h themselves (R. W. Cox and the NIfTI DFWG).
#pragma once
#include <zlib.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/volume/grid.h"
#include "server/import/child/input_files.h"

namespace spinaltap::importer {

/// Bytes of a file in memory, inflated a piece at a time where they are gzipped: a file that inflates to more than is
/// asked for costs nothing.
class ByteSource {
 public:
  explicit ByteSource(const std::string& bytes);
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  ~ByteSource();
  /// Fills `out`; false when the file ends first or is broken.
  [[nodiscard]] bool read(std::span<char> out);

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
  std::unique_ptr<z_stream> inflater_;
};

/// Voxel (i, j, k) of the file lies at origin + columns * (i, j, k), mm, LPS.
struct NiftiHeader {
  std::array<int, 3> dims{};
  Vec3 origin_patient;
  std::array<Vec3, 3> steps_patient;  ///< one voxel along each axis: orthogonal within kDirectionTolerance
  int datatype = 0;
  bool swapped = false;
  double slope = 1, intercept = 0;
  std::uint64_t skip = 0;  ///< bytes between the header and the voxels
  std::vector<std::string> notes;
};

/// @error Corrupt, Unsupported (two files, 4-D, type, units, no orientation, sheared), Limit.
[[nodiscard]] Result<NiftiHeader> readNiftiHeader(ByteSource& source, const std::string& name,
                                                  std::uint64_t voxel_limit);

/// Hands over the scaled voxels, one row along i after the other. @error of `row`, or Corrupt when the file ends early.
using NiftiRow = std::function<Result<void>(std::span<const double>)>;
[[nodiscard]] Result<void> readNiftiRows(ByteSource& source, const NiftiHeader& header, const std::string& name,
                                         const NiftiRow& row);

struct NiftiGrid {
  volume::Grid grid;
  bool reversed = false;  ///< i runs backwards in the file: its axes are left-handed
};
[[nodiscard]] NiftiGrid gridOf(const NiftiHeader& header);

/// A CT's voxel as HU. @error Corrupt when it is not finite or does not fit 16 bits.
[[nodiscard]] Result<std::int16_t> voxelToHu(double value, const std::string& name);

}  // namespace spinaltap::importer
