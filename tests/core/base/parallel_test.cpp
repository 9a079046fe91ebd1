#include "core/base/parallel.h"

#include <gtest/gtest.h>

#include <vector>

namespace spinaltap {
namespace {

TEST(ParallelBlocks, VisitsEveryIndexOnceInBlocksThatDoNotDependOnTheThreads) {
  for (const std::size_t count : {0UL, 1UL, 7UL, 64UL, 1000UL}) {
    for (const std::size_t block : {1UL, 7UL, 64UL, 5000UL}) {
      for (const unsigned threads : {0U, 1U, 2U, 5U}) {
        std::vector<int> visits(count, 0);
        std::vector<std::size_t> begin_of(count, count);
        parallelBlocks(count, block, threads, [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) visits[i] += 1, begin_of[i] = begin;
        });
        for (std::size_t i = 0; i < count; ++i) {
          EXPECT_EQ(visits[i], 1);
          EXPECT_EQ(begin_of[i], i / block * block);
        }
      }
    }
  }
}

}  // namespace
}  // namespace spinaltap
