// server/import/child/dicom_values.h - single elements of a data set, read strictly. Works on the value's bytes, since
// files in the wild carry them with VR UN.
#pragma once
#include <gdcmDataSet.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmSmartPointer.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace spinaltap::importer {

struct TagNumber {
  std::uint16_t group, element;
};

/// The text without trailing spaces and zero bytes; empty when absent.
[[nodiscard]] std::string textAt(const gdcm::DataSet& set, TagNumber tag);

/// Decimal strings (DS, IS) separated by backslashes: all of it must be finite numbers. Empty optional when absent,
/// empty or not numbers.
[[nodiscard]] std::optional<std::vector<double>> numbersAt(const gdcm::DataSet& set, TagNumber tag);

/// The first 16-bit value.
[[nodiscard]] std::optional<std::uint16_t> wordAt(const gdcm::DataSet& set, TagNumber tag);

/// Null when absent or no sequence.
[[nodiscard]] gdcm::SmartPointer<gdcm::SequenceOfItems> sequenceAt(const gdcm::DataSet& set, TagNumber tag);

[[nodiscard]] bool has(const gdcm::DataSet& set, TagNumber tag);

}  // namespace spinaltap::importer
