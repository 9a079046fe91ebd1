// server/import/child/dicom_bytes.h - the bytes that the parser is given: always a Part 10 file that is not deflated.
// Inflating here bounds it, and lets a file that ends too early be told from one that ends (DICOM PS3.10, PS3.5 A.5).
#pragma once
#include <streambuf>
#include <string>

#include "core/base/result.h"

namespace spinaltap::importer {

/// Empty when the bytes are fine as they are. A bare data set gets a preamble and a header that states the encoding
/// which its first bytes show; a deflated one is inflated.
/// @error Corrupt (broken deflate stream), Limit (inflates beyond what an image of its size can need).
[[nodiscard]] Result<std::string> asPart10(const std::string& bytes, const std::string& name);

/// A stream over bytes in memory: nothing has to be opened inside the sandbox, nothing is copied.
class MemoryBuffer : public std::streambuf {
 public:
  explicit MemoryBuffer(const std::string& bytes);
  /// True once a value was asked for of which the file holds only a part: the parser pads it with zeros and says
  /// nothing.
  [[nodiscard]] bool ranShort() const { return ran_short_; }

 protected:
  std::streamsize xsgetn(char* out, std::streamsize count) override;
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode mode) override;
  pos_type seekpos(pos_type target, std::ios_base::openmode mode) override;

 private:
  bool ran_short_ = false;
};

}  // namespace spinaltap::importer
