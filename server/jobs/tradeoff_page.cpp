#include "server/jobs/tradeoff_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "server/store/blob_store.h"

namespace spinaltap::jobs {
namespace {

using plots::escaped;
using plots::shortNumber;

constexpr std::array kColours{kBlue,
                              kRed,
                              kGreen,
                              kViolet,
                              kOchre,
                              kTeal,
                              kGrey,
                              Colour{"white", "#16191d"},
                              Colour{"#e4e4e4", "#343a41"},
                              Colour{"#888", "#7d858e"},
                              Colour{"#222", "#dfe3e8"},
                              Colour{"#111", "#f1f3f5"}};
constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; --ink: #1d2126; --soft: #555c64; --page: #fff; --line: #d5d9de; --mark: #e4f0fc; }
body { margin: 0; background: var(--page); color: var(--ink); font: 16px/1.5 system-ui, Helvetica, Arial, sans-serif; }
main { max-width: 84rem; margin: 0 auto; padding: 1.5rem; }
h1 { font-size: 1.6rem; margin: 0 0 .5rem; } h2 { font-size: 1.2rem; margin: 2rem 0 .5rem; }
.advice { border-left: .3rem solid #1668b8; background: var(--mark); padding: .6rem 1rem; margin: 1rem 0; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 22rem), 1fr)); gap: 1.2rem; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: .9rem; } svg { width: 100%; height: auto; }
.wide { margin-top: 1.2rem; } summary { cursor: pointer; color: var(--soft); }
.scroll { overflow-x: auto; } .scroll:focus-visible { outline: .15rem solid #1668b8; outline-offset: .15rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .85rem; }
caption { text-align: left; color: var(--soft); padding-bottom: .4rem; }
th, td { padding: .25rem .35rem; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
thead th { border-bottom: 2px solid var(--line); } tr.best { background: var(--mark); }
dt { font-weight: 600; float: left; clear: left; width: 7rem; } dd { margin: 0 0 .2rem 7.5rem; }
@media (prefers-color-scheme: dark) {
:root { --ink: #dfe3e8; --soft: #aab2bb; --page: #16191d; --line: #343a41; --mark: #1c2c3c; }
)";

std::string style() {
  std::string out(kStyle);
  for (const Colour& colour : kColours) {
    for (const std::string_view property : {"fill", "stroke"}) {
      for (const std::string_view part :
           {std::string_view("svg ["), property, std::string_view("=\""), colour.light, std::string_view("\"] { "),
            property, std::string_view(": "), colour.dark, std::string_view("; }\n")}) {
        out += part;
      }
    }
  }
  return out + "}\n";
}

/// Names below a chart stand in rows of two, or of three where there are more than four.
std::size_t namesARow(std::size_t names) { return names > 4 ? 3 : 2; }

double heightOf(std::size_t names) {
  const std::size_t rows = (names + namesARow(names) - 1) / namesARow(names);
  return 332 + 18 * static_cast<double>(rows);
}

void drawNames(plots::Svg& svg, const plots::Panel& panel, const std::vector<PageLine>& names) {
  const std::size_t a_row = namesARow(names.size());
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::size_t row = n / a_row, column = n % a_row;
    const double left = panel.corner[0] + panel.width * static_cast<double>(column) / static_cast<double>(a_row);
    const double at = 338 + 18 * static_cast<double>(row);
    svg.line({left, at}, {left + 26, at}, {names[n].colour.light, 2, names[n].dash});
    svg.text({left + 32, at + 4}, names[n].name, {12});
  }
}

}  // namespace

std::string cellOf(const Figures& row, const TableColumn& column) {
  const Figures& value = row[column.key];
  if (value.is_string()) return value.get<std::string>();
  const double number = value.get<double>();
  const bool is_error = std::string_view(column.key).find("_error_") != std::string_view::npos;
  if (std::abs(number) >= 1000) {
    if (!value.is_number_float()) return value.dump();
    const double scale = std::pow(10, std::floor(std::log10(std::abs(number))) - 2);  // three significant digits
    return std::to_string(std::llround(std::round(number / scale) * scale));
  }
  const std::string text = shortNumber(number);
  return is_error && number > 0 ? std::string("+").append(text) : text;
}

std::string textTable(std::span<const TableColumn> columns, const Figures& rows) {
  constexpr std::size_t kWide = 9;
  std::string out;
  const auto put = [&](const std::string& text) {
    out.append(text.size() < kWide ? kWide - text.size() : 1, ' ');
    out += text;
  };
  for (const TableColumn& column : columns) put(column.title);
  out += '\n';
  for (const Figures& row : rows) {
    for (const TableColumn& column : columns) put(cellOf(row, column));
    out += '\n';
  }
  return out;
}

std::string htmlTable(std::span<const TableColumn> columns, const Figures& rows, const std::string& name,
                      const std::string& caption, std::optional<std::size_t> best) {
  std::string out = "<div class=\"scroll\" role=\"region\" aria-labelledby=\"" + name +
                    "\" tabindex=\"0\">\n<table>\n<caption id=\"" + name + "\">" + escaped(caption) +
                    "</caption>\n<thead><tr>";
  for (const TableColumn& column : columns) out += "<th scope=\"col\">" + escaped(column.title) + "</th>";
  out += "</tr></thead>\n<tbody>\n";
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const bool is_best = best == n;
    out += is_best ? "<tr class=\"best\">" : "<tr>";
    for (const TableColumn& column : columns) {
      const std::string text = escaped(cellOf(rows[n], column));
      if (&column == &columns.front()) {
        out += "<th scope=\"row\">" + text + (is_best ? " <small>recommended</small>" : "") + "</th>";
      } else {
        out += "<td>" + text + "</td>";
      }
    }
    out += "</tr>\n";
  }
  return out + "</tbody>\n</table>\n</div>\n";
}

std::string meaningsOf(std::span<const TableColumn> columns) {
  std::string out = "<dl>\n";
  for (const TableColumn& column : columns) {
    out += "<dt>" + escaped(column.title) + "</dt><dd>" + escaped(column.meaning) + "</dd>\n";
  }
  return out + "</dl>\n";
}

std::string figureOf(const PageChart& chart, const plots::Axis& x) {
  std::vector<double> ys;
  for (const PageLine& line : chart.lines) {
    for (const plots::Place& p : line.points) ys.push_back(p[1]);
  }
  if (chart.level > 0) ys.push_back(chart.level);
  const plots::Axis y = plots::axisFor(chart.unit, ys, chart.logarithmic, !chart.logarithmic);
  std::vector<plots::Series> series;
  for (const PageLine& line : chart.lines) {
    series.push_back({line.name, line.colour.light, line.points, {}, true, line.dash, line.dots});
  }
  const plots::Panel panel{{70, 36}, chart.width, 240, chart.title};
  const std::vector<PageLine>& names = chart.legend.empty() ? chart.lines : chart.legend;
  plots::Svg svg(chart.width + 90, heightOf(names.size()));
  plots::drawPoints(svg, panel, x, y, series);
  if (chart.level > 0) plots::drawLevel(svg, panel, y, chart.level, chart.level_name);
  drawNames(svg, panel, names);
  return "<figure>\n" + svg.str(chart.title + ". " + chart.caption) + "<figcaption>" + escaped(chart.caption) +
         "</figcaption>\n</figure>\n";
}

std::string pageOf(const std::string& title, const std::string& heading, std::span<const std::string> advice,
                   const std::string& body) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n<meta "
      "charset=\"utf-8\"/>\n<meta "
      "name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>SpinalTap: " +
      escaped(title) + "</title>\n<style>" + style() + "</style>\n</head>\n<body>\n<main>\n<h1>" + escaped(heading) +
      "</h1>\n";
  for (const std::string& text : advice) out += "<p class=\"advice\">" + escaped(text) + "</p>\n";
  return out + body + "</main>\n</body>\n</html>\n";
}

Result<void> checkPage(const std::string& html) {
  namespace fs = std::filesystem;
  const fs::path page(html), folder = page.has_parent_path() ? page.parent_path() : fs::path(".");
  std::error_code ignored;
  if (html.empty() || (fs::is_directory(folder, ignored) && !fs::is_directory(page, ignored))) return {};
  return fail(ErrorCode::Io, "trade-off: cannot write " + html + ": " +
                                 (fs::is_directory(folder, ignored) ? "it is a folder" : "there is no such folder"));
}

Result<void> writePage(const std::string& html, const std::string& page) {
  return store::replaceFile(html, std::as_bytes(std::span(page)));
}

}  // namespace spinaltap::jobs
