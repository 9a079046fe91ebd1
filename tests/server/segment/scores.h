// How well isolate() does against labels drawn by hand: overlap, and the distance between the two surfaces.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "core/segment/isolate.h"
#include "server/import/import.h"

namespace spinaltap::test {

struct LabelledCase {
  std::string name;
  std::string ct, label;  ///< files below the folder of CTs
  int value = 0;          ///< of the vertebra in the label file
  Vec3 body_patient;      ///< middle of its body
};

/// Every labelled vertebra that is there in full. The bodies' middles are those that come with the data (verse-014: its
/// centroid file; tptbox-l3: the middle of its sub-region labels 49 and 50).
[[nodiscard]] const std::vector<LabelledCase>& labelledCases();

struct Score {
  double dice = 0;
  double mean_mm = 0, percentile95_mm = 0;  ///< between the boundary voxels of the two, both ways
  double seconds = 0;
};

/// @pre both on one grid, neither empty.
[[nodiscard]] Score compare(const volume::LabelVolume& ours, const volume::LabelVolume& truth);

/// One click: isolate() and its score. @error that of isolate.
[[nodiscard]] Result<Score> scoreClick(const importer::ImportedVolume& scan, const Vec3& click);

/// The middle of the body, then `count` - 1 places evenly spread in a ball of `radius_mm` round it.
[[nodiscard]] std::vector<Vec3> clicksAround(const Vec3& body, double radius_mm, int count, std::uint64_t seed);

[[nodiscard]] Result<importer::ImportedVolume> load(const std::filesystem::path& folder, const LabelledCase& one);

}  // namespace spinaltap::test
