// What a reader of the pictures relies on: round ticks, values where they belong, text that cannot break the file.
#include <gtest/gtest.h>

#include <zlib.h>

#include <cmath>
#include <limits>
#include <regex>

#include "server/plots/chart.h"
#include "server/plots/png.h"

namespace spinaltap::plots {
namespace {

std::size_t countOf(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(Numbers, AreShortAndForPeople) {
  EXPECT_EQ(shortNumber(0), "0");
  EXPECT_EQ(shortNumber(0.5), "0.5");
  EXPECT_EQ(shortNumber(30), "30");
  EXPECT_EQ(shortNumber(0.001), "0.001");
  EXPECT_EQ(shortNumber(-12.345), "-12.3");
  EXPECT_EQ(shortNumber(76028), "76028");
  EXPECT_EQ(px(1.0 / 3), "0.33");
  EXPECT_EQ(px(-0.001), "0");
}

TEST(Axes, HoldTheirValuesWithRoundTicks) {
  const Axis linear = axisFor("mm", {0.13, 0.47}, false, true);
  EXPECT_EQ(linear.low, 0);
  EXPECT_GE(linear.high, 0.47);
  const Axis logarithmic = axisFor("s", {0.3, 44}, true, false);
  EXPECT_TRUE(logarithmic.logarithmic);
  EXPECT_GT(logarithmic.low, 0);
  EXPECT_LE(logarithmic.low, 0.3);
  for (const Axis& axis : {linear, logarithmic}) {
    const auto ticks = ticksOf(axis);
    EXPECT_GE(ticks.size(), 2U);
    for (const double t : ticks) {
      EXPECT_GE(t, axis.low - 1e-12);
      EXPECT_LE(t, axis.high * (1 + 1e-12));
      if (t == 0) continue;
      // A multiple of 1, 2 or 5 times a power of ten has at most two digits here.
      const double digits = t / std::pow(10, std::floor(std::log10(t)) - 1);
      EXPECT_NEAR(digits, std::round(digits), 1e-9) << t;
    }
  }
  EXPECT_FALSE(axisFor("s", {0, 3}, true, false).logarithmic) << "zero has no logarithm";
  const Axis of_nothing = axisFor("s", {}, false, false);
  EXPECT_LT(of_nothing.low, of_nothing.high);
  const Axis of_one = axisFor("s", {5}, false, false);
  EXPECT_LT(of_one.low, of_one.high);
}

TEST(Page, EscapesWhatANameHolds) {
  Svg svg(100, 50);
  svg.text({1, 2}, "a<b & \"c\"");
  const std::string page = svg.str();
  EXPECT_NE(page.find("a&lt;b &amp; &quot;c&quot;"), std::string::npos);
  EXPECT_EQ(page.rfind("<svg", 0), 0U);
  EXPECT_NE(page.find("</svg>"), std::string::npos);
}

TEST(Charts, NameTicksAndLeaveOutDotsWhenAsked) {
  const Axis x{"ms", 0, 2, false, {0, 1}, {"none", "some"}}, y{"N", 0, 2, false};
  Series line{"one", "#123456", {{0, 0.5}, {1, 1}}, {}, true};
  line.dots = false;
  Svg svg(400, 300);
  drawPoints(svg, {{50, 20}, 300, 200, "title"}, x, y, {line});
  const std::string page = svg.str();
  EXPECT_NE(page.find(">none<"), std::string::npos);
  EXPECT_NE(page.find(">some<"), std::string::npos);
  EXPECT_EQ(countOf(page, "<polyline"), 1U);
  EXPECT_EQ(countOf(page, "<circle"), 0U);
}

TEST(Charts, PutPointsWhereTheAxesSay) {
  Svg svg(400, 300);
  const Panel panel{{50, 20}, 300, 200, "title"};
  const Axis x{"s", 1, 100, true}, y{"mm", 0, 2, false};
  drawPoints(svg, panel, x, y, {{"one", "#123456", {{10, 0.5}}, {"here"}, false}});
  const std::string page = svg.str();
  // Half-way along a logarithmic axis of two decades; three quarters down.
  std::smatch found;
  ASSERT_TRUE(std::regex_search(page, found, std::regex("<circle cx=\"([0-9.]+)\" cy=\"([0-9.]+)\"[^>]*#123456")));
  EXPECT_NEAR(std::stod(found[1]), 200, 0.01);
  EXPECT_NEAR(std::stod(found[2]), 170, 0.01);
  EXPECT_NE(page.find(">here<"), std::string::npos);
  EXPECT_NE(page.find(">title<"), std::string::npos);
}

TEST(Charts, NameALevelInsideThePanelWhereverItLies) {
  const Panel panel{{50, 20}, 300, 200, "title"};
  const Axis y{"us", 0, 2, false};
  for (const double value : {0.0, 0.01, 1.0, 1.9, 1.99, 2.0}) {
    Svg svg(400, 300);
    drawLevel(svg, panel, y, value, "as much as may be");
    const std::string page = svg.str();
    std::smatch line, name;
    ASSERT_TRUE(std::regex_search(page, line, std::regex("<line [^>]*y1=\"([0-9.]+)\"")));
    ASSERT_TRUE(std::regex_search(page, name, std::regex("<text [^>]*y=\"([0-9.]+)\"[^>]*>as much as may be<")));
    const double at = std::stod(line[1]), base = std::stod(name[1]);
    EXPECT_NEAR(at, 220 - 100 * value, 0.01);
    EXPECT_GT(base - 11, 20) << "letters of 11 px stay below the frame's upper edge, at " << value;
    EXPECT_LT(base, 220) << value;
    EXPECT_TRUE(base < at || base - 11 > at) << "the line crosses no letter, at " << value;
  }
}

TEST(Charts, TakeTheTicksThatAreAskedFor) {
  Axis axis = axisFor("spacing, mm", {0.4, 0.025}, true, false);
  axis.ticks = {0.025, 0.4};
  EXPECT_EQ(ticksOf(axis), (std::vector<double>{0.025, 0.4}));
}

TEST(Charts, ABarThatIsNotThereLeavesItsPlaceEmpty) {
  const Panel panel{{50, 20}, 300, 200, ""};
  const Axis y{"mm", 0, 2, false};
  const double none = std::numeric_limits<double>::quiet_NaN();
  Svg with(400, 300), without(400, 300);
  drawBars(with, panel, y, {{"a", {1, 2}}}, {"#111111", "#222222"});
  drawBars(without, panel, y, {{"a", {1, none}}}, {"#111111", "#222222"});
  EXPECT_EQ(countOf(with.str(), "height=\"200\" fill=\"#222222\""), 1U) << "2 of 2 is the whole height";
  EXPECT_EQ(countOf(without.str(), "<rect"), countOf(with.str(), "<rect") - 1);
  EXPECT_EQ(without.str().find("nan"), std::string::npos);
}

TEST(Picture, IsAPngThatHoldsThePixels) {
  const std::vector<std::uint8_t> grey{0, 128, 255, 7, 8, 9};
  const std::string address = pngAddress(grey, 3, 2), head = "data:image/png;base64,";
  ASSERT_EQ(address.rfind(head, 0), 0U);
  std::vector<unsigned char> bytes;
  unsigned held = 0, bits = 0;
  for (const char c : address.substr(head.size())) {
    if (c == '=') break;
    const auto digit = std::string("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/").find(c);
    ASSERT_NE(digit, std::string::npos);
    held = held << 6 | static_cast<unsigned>(digit), bits += 6;
    if (bits >= 8) bits -= 8, bytes.push_back(static_cast<unsigned char>(held >> bits));
  }
  // Signature, then IHDR of 13 bytes and its check, then IDAT.
  const std::vector<unsigned char> start{0x89, 'P', 'N', 'G', 13, 10, 26, 10, 0, 0, 0, 13, 'I', 'H', 'D',
                                         'R',  0,   0,   0,   3,  0,  0,  0,  2, 8, 0, 0,  0,   0};
  ASSERT_GT(bytes.size(), start.size() + 12);
  EXPECT_TRUE(std::equal(start.begin(), start.end(), bytes.begin()));
  const std::size_t at = start.size() + 4;
  const std::size_t length = bytes[at + 2] * 256U + bytes[at + 3];
  std::array<unsigned char, 8> rows{};
  uLongf size = rows.size();
  ASSERT_EQ(::uncompress(rows.data(), &size, bytes.data() + at + 8, length), Z_OK);
  EXPECT_EQ(size, 8U);
  EXPECT_EQ(rows, (std::array<unsigned char, 8>{0, 0, 128, 255, 0, 7, 8, 9}));
}

}  // namespace
}  // namespace spinaltap::plots
