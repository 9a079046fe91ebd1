#include "server/import/child/dicom_values.h"

#include <gdcmByteValue.h>

#include <cmath>
#include <cstdlib>
#include <cstring>

namespace spinaltap::importer {

namespace {

gdcm::Tag tagOf(TagNumber tag) { return {tag.group, tag.element}; }

const gdcm::ByteValue* bytesAt(const gdcm::DataSet& set, TagNumber tag) {
  if (!set.FindDataElement(tagOf(tag))) return nullptr;
  return set.GetDataElement(tagOf(tag)).GetByteValue();
}

/// strtod alone would take hexadecimal, infinities and trailing text.
std::optional<double> decimal(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  const std::size_t last = text.find_last_not_of(' ');
  if (first == std::string::npos) return std::nullopt;
  const std::string trimmed = text.substr(first, last - first + 1);
  if (trimmed.find_first_not_of("+-0123456789.eE") != std::string::npos) return std::nullopt;
  char* end = nullptr;
  const double value = std::strtod(trimmed.c_str(), &end);
  if (end != trimmed.c_str() + trimmed.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace

std::string textAt(const gdcm::DataSet& set, TagNumber tag) {
  const gdcm::ByteValue* bytes = bytesAt(set, tag);
  if (bytes == nullptr || bytes->GetPointer() == nullptr) return {};
  std::string text(bytes->GetPointer(), bytes->GetLength());
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

std::optional<std::vector<double>> numbersAt(const gdcm::DataSet& set, TagNumber tag) {
  const std::string text = textAt(set, tag);
  std::vector<double> numbers;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t end = std::min(text.find('\\', at), text.size());
    const auto number = decimal(text.substr(at, end - at));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    at = end + 1;
  }
  return numbers;
}

std::optional<std::uint16_t> wordAt(const gdcm::DataSet& set, TagNumber tag) {
  const gdcm::ByteValue* bytes = bytesAt(set, tag);
  if (bytes == nullptr || bytes->GetPointer() == nullptr || bytes->GetLength() < 2) return std::nullopt;
  std::uint16_t word = 0;
  std::memcpy(&word, bytes->GetPointer(), sizeof word);  // the reader has swapped it to the order of this machine
  return word;
}

gdcm::SmartPointer<gdcm::SequenceOfItems> sequenceAt(const gdcm::DataSet& set, TagNumber tag) {
  if (!set.FindDataElement(tagOf(tag))) return nullptr;
  return set.GetDataElement(tagOf(tag)).GetValueAsSQ();
}

bool has(const gdcm::DataSet& set, TagNumber tag) { return set.FindDataElement(tagOf(tag)); }

}  // namespace spinaltap::importer
