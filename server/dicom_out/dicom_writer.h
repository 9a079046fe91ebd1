// server/dicom_out/dicom_writer.h - one CT slice as a DICOM Part 10 file, written by hand.
// After: DICOM PS3.3 (CT Image IOD), PS3.5 (data elements, explicit VR little endian), PS3.10 (file meta information).
// Only the import child may link a DICOM library; writing one kind of file needs none.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/volume/grid.h"

namespace spinaltap::dicom_out {

/// What is the same in every slice of a series.
struct SeriesIdentity {
  std::uint64_t uid_seed = 1;            ///< every UID derives from it, under 2.25 (PS3.5 annex B.2)
  std::string patient_name = "Phantom";  ///< PN, of invented patients only
  std::string patient_id = "PHANTOM";
  std::string description = "Phantom";
  double slice_thickness_mm = 1.0;
};

/// 2.25.<decimal of a UUID made from the seed and these numbers>; at most 44 characters.
[[nodiscard]] std::string uidFrom(std::uint64_t seed, std::uint64_t role, std::uint64_t index);

/// A decimal string (VR DS) of at most 16 characters, to at least nine significant digits.
[[nodiscard]] std::string decimalString(double value);

/// Slice k of the volume: CT Image Storage, explicit VR little endian, 12 bits stored in 16, unsigned, intercept -1024.
/// Values beyond -1024 .. 3071 HU are clamped. The same bytes for the same arguments.
/// @pre  0 <= k < dims[2]; dims[0] and dims[1] at most 65535; a grid that passes volume::checkGrid.
[[nodiscard]] std::vector<std::uint8_t> sliceFile(const volume::CtVolume& ct, int k, const SeriesIdentity& identity);

}  // namespace spinaltap::dicom_out
