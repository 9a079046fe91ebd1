// tests/server/import/shared_data.h - tables of what the files under ../shared/data must give.
#pragma once
#include <algorithm>

#include "tests/server/import/made_files.h"

namespace spinaltap::importer {

namespace fs = std::filesystem;

inline const fs::path kShared = SPINALTAP_SHARED_DATA;

#define NEED_SHARED_DATA() \
  if (!fs::exists(kShared)) GTEST_SKIP() << "no ../shared/data"

inline Result<ImportedVolume> importAs(const fs::path& from, bool single_slice) {
  ImportRequest request;
  request.from = from;
  request.allow_single_slice = single_slice;
  return importVolume(request);
}

/// One slice, to look at what a file decodes to.
inline Result<ImportedVolume> importSlice(const fs::path& file) { return importAs(file, true); }

/// Names that stand in the headers of these files.
inline void expectNoNames(const Error& error) {
  expectClean(error);
  EXPECT_EQ(error.message.find(kShared.string()), std::string::npos) << error.message;
  EXPECT_EQ(error.message.find('/'), std::string::npos) << error.message;
  for (const char* name : {"CompressedSamples", "Doe", "DOE", "Test^", "Anonymous", "<script", "rm -rf"}) {
    EXPECT_EQ(error.message.find(name), std::string::npos) << error.message;
  }
}

struct Expected {
  const char* file;
  const char* word;  ///< that the refusal holds; nullptr: loads
};

/// Every file must be in the table and every line of the table must be a file.
inline void checkTable(const fs::path& folder, std::span<const Expected> table, bool single_slice) {
  std::size_t found = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const auto row = std::find_if(table.begin(), table.end(), [&](const Expected& e) { return name == e.file; });
    ASSERT_NE(row, table.end()) << name << " is in no table";
    ++found;
    const auto result = importAs(entry.path(), single_slice);
    if (row->word == nullptr) {
      ASSERT_TRUE(result.has_value()) << name << ": " << result.error().message;
      continue;
    }
    ASSERT_FALSE(result.has_value()) << name << " loaded";
    EXPECT_NE(result.error().message.find(row->word), std::string::npos) << name << ": " << result.error().message;
    expectNoNames(result.error());
  }
  EXPECT_EQ(found, table.size());
}

}  // namespace spinaltap::importer
