#include "server/plots/svg.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <initializer_list>

namespace spinaltap::plots {
namespace {

/// Everything in one string.
std::string all(std::initializer_list<std::string_view> parts) {
  std::string out;
  for (const std::string_view part : parts) out.append(part);
  return out;
}

std::string attributes(const Stroke& s) {
  std::string out = all({" fill=\"none\" stroke=\"", s.colour, "\" stroke-width=\"", px(s.width), "\""});
  if (!s.dash.empty()) out += all({" stroke-dasharray=\"", s.dash, "\""});
  return out;
}

std::string xy(const Place& p, const char* x = "x", const char* y = "y") {
  return all({" ", x, "=\"", px(p[0]), "\" ", y, "=\"", px(p[1]), "\""});
}

std::string size(double width, double height) {
  return all({" width=\"", px(width), "\" height=\"", px(height), "\""});
}

std::string withoutZeros(std::string text) {
  if (text.find('.') == std::string::npos || text.find('e') != std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string px(double value) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.2f", value);
  return withoutZeros(buffer.data());
}

std::string shortNumber(double value) {
  std::array<char, 40> buffer{};
  const double size = std::abs(value);
  if (size != 0 && (size < 1e-4 || size >= 1e6)) {
    std::snprintf(buffer.data(), buffer.size(), "%.3g", value);
    return buffer.data();
  }
  int decimals = 2;
  for (double s = size; s >= 9.995 && decimals > 0; s /= 10) --decimals;
  for (double s = size; s != 0 && s < 0.9995 && decimals < 6; s *= 10) ++decimals;
  std::snprintf(buffer.data(), buffer.size(), "%.*f", decimals, value);
  return withoutZeros(buffer.data());
}

Svg::Svg(double width, double height) : width_(width), height_(height) {}

void Svg::line(const Place& from, const Place& to, const Stroke& stroke) {
  body_ += all({"<line", xy(from, "x1", "y1"), xy(to, "x2", "y2"), attributes(stroke), "/>\n"});
}

void Svg::lines(std::span<const std::string> path_data, const Stroke& stroke) {
  body_ += "<path d=\"";
  for (const std::string& d : path_data) body_ += d;
  body_ += all({"\"", attributes(stroke), " stroke-linejoin=\"round\"/>\n"});
}

void Svg::polyline(std::span<const Place> places, const Stroke& stroke) {
  body_ += "<polyline points=\"";
  for (const Place& p : places) body_ += all({px(p[0]), ",", px(p[1]), " "});
  body_ += all({"\"", attributes(stroke), " stroke-linejoin=\"round\"/>\n"});
}

void Svg::circle(const Place& centre, double radius, std::string_view fill, std::string_view outline) {
  body_ += all(
      {"<circle", xy(centre, "cx", "cy"), " r=\"", px(radius), "\" fill=\"", fill, "\" stroke=\"", outline, "\"/>\n"});
}

void Svg::rect(const Place& corner, double width, double height, std::string_view fill) {
  body_ += all({"<rect", xy(corner), size(width, height), " fill=\"", fill, "\"/>\n"});
}

void Svg::frame(const Place& corner, double width, double height, const Stroke& stroke) {
  body_ += all({"<rect", xy(corner), size(width, height), attributes(stroke), "/>\n"});
}

void Svg::text(const Place& at, std::string_view text, const TextStyle& style) {
  static constexpr std::array<std::string_view, 3> kAnchors{"start", "middle", "end"};
  body_ += all({"<text", xy(at), " font-size=\"", px(style.size), "\" fill=\"", style.colour, "\" text-anchor=\"",
                kAnchors[static_cast<std::size_t>(style.anchor)], "\""});
  if (style.bold) body_ += " font-weight=\"bold\"";
  if (style.upwards) body_ += all({" transform=\"rotate(-90 ", px(at[0]), " ", px(at[1]), ")\""});
  body_ += all({">", escaped(text), "</text>\n"});
}

void Svg::image(const Place& corner, double width, double height, std::string_view href) {
  body_ += all({"<image", xy(corner), size(width, height), " preserveAspectRatio=\"none\" href=\"", href, "\"/>\n"});
}

void Svg::clipTo(const Place& corner, double width, double height) {
  const std::string id = std::to_string(++clips_);
  body_ += all({"<clipPath id=\"clip", id, "\"><rect", xy(corner), size(width, height),
                "/></clipPath>\n<g clip-path=\"url(#clip", id, ")\">\n"});
}

void Svg::endClip() { body_ += "</g>\n"; }

std::string Svg::str(std::string_view label) const {
  const std::string called = label.empty() ? "" : all({" role=\"img\" aria-label=\"", escaped(label), "\""});
  return all({"<svg xmlns=\"http://www.w3.org/2000/svg\"", size(width_, height_), " viewBox=\"0 0 ", px(width_), " ",
              px(height_), "\" font-family=\"Helvetica, Arial, sans-serif\"", called, ">\n",
              "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n", body_, "</svg>\n"});
}

}  // namespace spinaltap::plots
