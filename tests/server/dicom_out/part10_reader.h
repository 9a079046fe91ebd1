// tests/server/dicom_out/part10_reader.h - a tiny reader of explicit VR little endian files, strict where the standard
// is: it shares no code with the writer it checks.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace spinaltap::dicom_out::test {

struct Element {
  std::string vr, value;
};

/// Tag (group << 16 | element) to element; empty when a rule is broken, with the reason in `complaint`.
struct Part10 {
  std::map<std::uint32_t, Element> elements;
  std::string complaint;

  [[nodiscard]] std::string text(std::uint32_t tag) const {
    const auto found = elements.find(tag);
    if (found == elements.end()) return "(absent)";
    std::string value = found->second.value;
    while (!value.empty() && (value.back() == ' ' || value.back() == '\0')) value.pop_back();
    return value;
  }
  [[nodiscard]] int number(std::uint32_t tag) const {
    const std::string& v = elements.at(tag).value;
    return static_cast<unsigned char>(v[0]) | static_cast<unsigned char>(v[1]) << 8;
  }
  [[nodiscard]] std::vector<double> decimals(std::uint32_t tag) const {
    std::vector<double> out;
    const std::string all = text(tag);
    for (std::size_t from = 0; from <= all.size();) {
      const std::size_t to = std::min(all.find('\\', from), all.size());
      out.push_back(std::stod(all.substr(from, to - from)));
      from = to + 1;
    }
    return out;
  }
};

inline Part10 readPart10(const std::vector<std::uint8_t>& bytes) {
  Part10 file;
  const auto complain = [&file](const std::string& why) {
    file.elements.clear();
    file.complaint = why;
    return file;
  };
  const auto u = [&bytes](std::size_t at, int size) {
    std::uint32_t v = 0;
    for (int n = 0; n < size; ++n) v |= static_cast<std::uint32_t>(bytes[at + static_cast<std::size_t>(n)]) << (8 * n);
    return v;
  };
  if (bytes.size() < 132 || std::string(bytes.begin() + 128, bytes.begin() + 132) != "DICM") return complain("no DICM");
  std::size_t at = 132, meta_end = 0;
  std::uint32_t last = 0;
  while (at < bytes.size()) {
    if (at + 8 > bytes.size()) return complain("cut short in a header");
    const std::uint32_t tag = u(at, 2) << 16 | u(at + 2, 2);
    if (tag <= last) return complain("tags do not ascend");
    last = tag;
    const std::string vr(bytes.begin() + static_cast<std::ptrdiff_t>(at) + 4,
                         bytes.begin() + static_cast<std::ptrdiff_t>(at) + 6);
    const bool wide = vr == "OB" || vr == "OW";
    if (wide && u(at + 6, 2) != 0) return complain("reserved bytes are not zero");
    const std::uint32_t length = wide ? u(at + 8, 4) : u(at + 6, 2);
    at += wide ? 12 : 8;
    if (length % 2 != 0) return complain("odd length");
    if (at + length > bytes.size()) return complain("value runs past the end");
    file.elements[tag] = {vr, std::string(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                                          bytes.begin() + static_cast<std::ptrdiff_t>(at + length))};
    at += length;
    if (tag == 0x00020000) meta_end = at + u(at - 4, 4);
    if (tag <= 0x0002ffff && at > meta_end) return complain("group 2 is longer than it says");
    if (tag > 0x0002ffff && meta_end == 0) return complain("no group length");
  }
  return file;
}

}  // namespace spinaltap::dicom_out::test
