// server/plots/svg.h - shapes and texts on a page.
#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>

namespace spinaltap::plots {

using Place = std::array<double, 2>;  ///< px, right and down

struct Stroke {
  std::string_view colour = "#333";
  double width = 1;
  std::string_view dash;  ///< as stroke-dasharray; empty: none
};

enum class Anchor { Start, Middle, End };

struct TextStyle {
  double size = 12;
  Anchor anchor = Anchor::Start;
  std::string_view colour = "#222";
  bool bold = false, upwards = false;  ///< upwards: turned by a quarter, read from below
};

/// White page, sans serif. Texts are escaped; colours and dashes are written as they are.
class Svg {
 public:
  Svg(double width, double height);

  void line(const Place& from, const Place& to, const Stroke& stroke);
  /// Several lines in one shape.
  void lines(std::span<const std::string> path_data, const Stroke& stroke);
  void polyline(std::span<const Place> places, const Stroke& stroke);
  void circle(const Place& centre, double radius, std::string_view fill, std::string_view outline = "none");
  void rect(const Place& corner, double width, double height, std::string_view fill);
  void frame(const Place& corner, double width, double height, const Stroke& stroke);
  void text(const Place& at, std::string_view text, const TextStyle& style = {});
  /// @param href  a data: address.
  void image(const Place& corner, double width, double height, std::string_view href);
  /// What is drawn between the two is cut off at the rectangle.
  void clipTo(const Place& corner, double width, double height);
  void endClip();

  /// The whole document. With a label it is one picture to whoever has a page read out, and that is what it is called.
  [[nodiscard]] std::string str(std::string_view label = {}) const;

 private:
  double width_, height_;
  int clips_ = 0;
  std::string body_;
};

/// For text and attributes of SVG and HTML.
[[nodiscard]] std::string escaped(std::string_view text);
/// At most two decimals, no trailing zeros.
[[nodiscard]] std::string px(double value);
/// For people: three significant digits, no needless zeros or exponents from 1e-4 to 1e6.
[[nodiscard]] std::string shortNumber(double value);

}  // namespace spinaltap::plots
