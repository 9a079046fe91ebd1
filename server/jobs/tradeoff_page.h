// server/jobs/tradeoff_page.h - what the trade-offs' pages and tables share: one HTML file with charts (inline SVG) and
// tables. Asks for nothing from elsewhere and runs no script; well-formed XML too; light or dark as the reader's system
// is.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/jobs/figures.h"
#include "server/plots/chart.h"

namespace spinaltap::jobs {

/// A column, in the program's table and in the page's.
struct TableColumn {
  const char *title, *key, *meaning;
};
/// A row's figure as people read it; errors with their sign.
[[nodiscard]] std::string cellOf(const Figures& row, const TableColumn& column);
/// For people: titles and rows, aligned.
[[nodiscard]] std::string textTable(std::span<const TableColumn> columns, const Figures& rows);
/// The same for a page, that scrolls where it is too wide. @param best a row to be marked.
[[nodiscard]] std::string htmlTable(std::span<const TableColumn> columns, const Figures& rows, const std::string& name,
                                    const std::string& caption, std::optional<std::size_t> best = {});
[[nodiscard]] std::string meaningsOf(std::span<const TableColumn> columns);

/// A colour of the charts, which are drawn for white paper, and what stands for it on a dark page.
struct Colour {
  std::string_view light, dark;
};
inline constexpr Colour kBlue{"#1668b8", "#62b5ff"}, kRed{"#b23a26", "#ff8a78"}, kGreen{"#2a7d3a", "#6fce82"},
    kViolet{"#7a3fa0", "#c99bf0"}, kOchre{"#9a6200", "#f0b050"}, kTeal{"#0b7f86", "#58cfd6"}, kGrey{"#555", "#aab2bb"};

struct PageLine {
  std::string name;
  Colour colour;
  std::string_view dash;
  std::vector<plots::Place> points;
  bool dots = true;
};
struct PageChart {
  std::string title, unit, caption;
  std::vector<PageLine> lines;
  double level = 0;  ///< a level across, if positive
  std::string level_name = {};
  std::vector<PageLine> legend = {};  ///< empty: the lines
  bool logarithmic = true;            ///< the axis upwards; without it, from zero
  double width = 370;
};
/// The chart with its caption. @param x the axis to the right.
[[nodiscard]] std::string figureOf(const PageChart& chart, const plots::Axis& x);

/// @param title in the reader's list of pages; heading above; advice: plain text, a paragraph each; body: HTML.
[[nodiscard]] std::string pageOf(const std::string& title, const std::string& heading,
                                 std::span<const std::string> advice, const std::string& body);

/// Minutes of measuring are not to be lost because the page has no place. @error Io. An empty path is fine.
[[nodiscard]] Result<void> checkPage(const std::string& html);
/// @error Io.
[[nodiscard]] Result<void> writePage(const std::string& html, const std::string& page);

}  // namespace spinaltap::jobs
