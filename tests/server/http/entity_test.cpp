#include "server/http/entity.h"

#include <gtest/gtest.h>

namespace spinaltap::http {
namespace {

TEST(DecodePath, DecodesAndCutsTheQuery) {
  EXPECT_EQ(decodePath("/a%20b/%63?x=/../y#z"), "/a b/c");
  EXPECT_EQ(decodePath("/"), "/");
}

TEST(DecodePath, RefusesWhatCouldLeaveAFolder) {
  for (const char* bad : {"", "a", "*", "/../etc/passwd", "/a/../b", "/%2e%2e/x", "/..", "/.", "/a/%2E%2e%2fb", "/a\\b",
                          "/%5c", "/%00", "/%", "/%4", "/%zz", "http://elsewhere/"}) {
    EXPECT_EQ(decodePath(bad), "") << bad;
  }
}

TEST(TakesGzip, FollowsNamesAndQuality) {
  for (const char* yes : {"gzip", "deflate, gzip", "gzip;q=0.5", "*", "gzip ; q=1, br"})
    EXPECT_TRUE(takesGzip(yes)) << yes;
  for (const char* no : {"", "br", "identity", "gzip;q=0", "gzip;q=0.00", "gzip;q=0, *", "x-gzip2"}) {
    EXPECT_FALSE(takesGzip(no)) << no;
  }
}

struct RangeCase {
  const char* header;
  RangeKind kind;
  std::uint64_t first, last;
};
class Ranges : public testing::TestWithParam<RangeCase> {};
TEST_P(Ranges, AreReadAsRfc9110Says) {
  ByteRange range;
  EXPECT_EQ(parseRange(GetParam().header, 1000, range), GetParam().kind);
  EXPECT_EQ(range.first, GetParam().first);
  EXPECT_EQ(range.last, GetParam().last);
}
constexpr auto kNone = RangeKind::None, kOne = RangeKind::One, kNot = RangeKind::Unsatisfiable;
INSTANTIATE_TEST_SUITE_P(OfAThousandBytes, Ranges,
                         testing::Values(RangeCase{"bytes=0-99", kOne, 0, 99}, RangeCase{"bytes=0-0", kOne, 0, 0},
                                         RangeCase{"bytes=990-2000", kOne, 990, 999},
                                         RangeCase{"bytes=990-", kOne, 990, 999},
                                         RangeCase{"bytes=-10", kOne, 990, 999}, RangeCase{"bytes=-5000", kOne, 0, 999},
                                         RangeCase{"bytes=1000-", kNot, 0, 0}, RangeCase{"bytes=-0", kNot, 0, 0},
                                         RangeCase{"bytes=5-2", kNone, 0, 0}, RangeCase{"bytes=0-1,5-6", kNone, 0, 0},
                                         RangeCase{"bytes=a-b", kNone, 0, 0}, RangeCase{"bytes=", kNone, 0, 0},
                                         RangeCase{"bytes=-", kNone, 0, 0}, RangeCase{"lines=0-1", kNone, 0, 0},
                                         RangeCase{"bytes=99999999999999999999-", kNone, 0, 0}));

}  // namespace
}  // namespace spinaltap::http
