// segment_scores [--clicks N] [--radius MM] [--seed N]: the table case x click -> Dice, distances, seconds.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/server/segment/scores.h"

int main(int argc, char** argv) {
  using namespace spinaltap;
  int clicks = 9;
  double radius_mm = 5;
  std::uint64_t seed = 1;
  for (int a = 1; a + 1 < argc; a += 2) {
    const std::string option = argv[a];
    if (option == "--clicks") clicks = std::atoi(argv[a + 1]);
    if (option == "--radius") radius_mm = std::atof(argv[a + 1]);
    if (option == "--seed") seed = std::strtoull(argv[a + 1], nullptr, 10);
  }
  const std::filesystem::path folder = std::filesystem::path(SPINALTAP_SHARED_DATA) / "ct";
  std::printf("1 action each: a click in the body, %d places within %.1f mm of its middle, seed %llu\n", clicks,
              radius_mm, static_cast<unsigned long long>(seed));
  std::printf("%-13s %6s %6s %6s %8s %8s %8s %6s\n", "case", "Dice", "median", "worst", "mean mm", "95 % mm",
              "worst 95", "s");
  for (const auto& one : test::labelledCases()) {
    const auto scan = test::load(folder, one);
    if (!scan) {
      std::fprintf(stderr, "%s: %s\n", one.name.c_str(), scan.error().message.c_str());
      return 1;
    }
    std::vector<double> dice, far;
    test::Score middle;
    double slowest = 0;
    int failed = 0;
    for (const Vec3& click : test::clicksAround(one.body_patient, radius_mm, clicks, seed)) {
      const auto score = test::scoreClick(*scan, click);
      if (dice.empty() && score) middle = *score;
      failed += score ? 0 : 1;
      dice.push_back(score ? score->dice : 0);
      far.push_back(score ? score->percentile95_mm : 1e9);
      if (score) slowest = std::max(slowest, score->seconds);
    }
    std::sort(dice.begin(), dice.end());
    std::printf("%-13s %6.4f %6.4f %6.4f %8.2f %8.2f %8.2f %6.2f\n", one.name.c_str(), middle.dice,
                dice[dice.size() / 2], dice.front(), middle.mean_mm, middle.percentile95_mm,
                *std::max_element(far.begin(), far.end()), slowest);
    if (failed > 0) std::printf("%13s %d clicks found no body\n", "", failed);
  }
  return 0;
}
