#include "server/jobs/trace.h"

#include <gtest/gtest.h>

#include <cmath>

namespace spinaltap::jobs {
namespace {

std::string messageOf(std::string_view text) {
  const auto parsed = parseTrace(text, "a.csv");
  return parsed ? "" : parsed.error().message;
}

TEST(Trace, ReadsCommasBlanksTabsAndSemicolons) {
  for (const char* line : {"1000,0.5,-1,2e1,0,0,1", "1000 0.5 -1 2e1 0 0 1", "1000\t0.5\t-1\t2e1\t0\t0\t1",
                           "1000; 0.5; -1; 2e1; 0; 0; 1", " 1e3 , +0.5 , -1.0 , 20 , 0 , 0 , 1 \r"}) {
    const auto poses = parseTrace(line, "a.csv").value();
    ASSERT_EQ(poses.size(), 1u) << line;
    EXPECT_EQ(poses[0], (session::Input{1000, {0.5, -1, 20}, {0, 0, 1}, true})) << line;
  }
}

TEST(Trace, SkipsAHeaderCommentsEmptyLinesAndAByteOrderMark) {
  const auto poses = parseTrace(
      "\xef\xbb\xbf# made by hand\r\n\r\nt_us,tip_x,tip_y,tip_z,axis_x,axis_y,axis_z\r\n0,0,0,0,0,0,1\r\n#\n\n"
      "1000,0,0,1,0,0,1",
      "a.csv");
  ASSERT_TRUE(poses.has_value());
  EXPECT_EQ(poses->size(), 2u);
}

TEST(Trace, KeepsEveryBitOfANumber) {
  const auto poses = parseTrace("0,0.1,1e-320,-0.30000000000000004,0,0,1", "a.csv").value();
  EXPECT_EQ(poses[0].tip_mm.x, 0.1);
  EXPECT_EQ(poses[0].tip_mm.y, 1e-320);
  EXPECT_EQ(poses[0].tip_mm.z, -0.30000000000000004);
}

TEST(Trace, LeavesWhatIsNoPoseToTheSession) {
  const auto poses = parseTrace("0,nan,inf,-inf,0,0,0", "a.csv").value();
  EXPECT_TRUE(std::isnan(poses[0].tip_mm.x));
  EXPECT_TRUE(std::isinf(poses[0].tip_mm.y));
}

TEST(Trace, NamesFileLineAndField) {
  EXPECT_EQ(messageOf("0,0,0,0,0,0,1\n\n0,0,0,zero,0,0,1"), "a.csv line 3: tip z is not a number: 'zero'");
  EXPECT_EQ(messageOf("0,0,0,0,0,0"), "a.csv line 1: 7 numbers are needed (t_us, tip x y z, axis x y z), 6 found");
  EXPECT_EQ(messageOf("0,0,0,0,0,0,1,2"), "a.csv line 1: more than 7 numbers");
  EXPECT_EQ(messageOf("0.5,0,0,0,0,0,1"), "a.csv line 1: t_us is not a whole number of microseconds: '0.5'");
  EXPECT_EQ(messageOf("-1,0,0,0,0,0,1"), "a.csv line 1: t_us is not a whole number of microseconds: '-1'");
  EXPECT_EQ(messageOf("t,x\nt,x"), "a.csv line 2: t_us is not a whole number of microseconds: 't'");
  EXPECT_EQ(messageOf("0,1e999,0,0,0,0,1"), "a.csv line 1: tip x is not a number: '1e999'");
  EXPECT_EQ(messageOf(""), "a.csv: no poses");
  EXPECT_EQ(messageOf("# nothing\n"), "a.csv: no poses");
}

}  // namespace
}  // namespace spinaltap::jobs
