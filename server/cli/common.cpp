#include <array>
#include <charconv>
#include <cmath>

#include "core/rbf/rbf.h"
#include "server/cli/commands.h"

namespace spinaltap::cli {

Result<Vec3> parseVec3(const std::string& text, const char* option) {
  const auto wrong = [&]() -> Result<Vec3> {
    return fail(ErrorCode::InvalidArgument,
                std::string(option) + " needs three numbers in mm, x,y,z, not '" + text.substr(0, 60) + "'");
  };
  std::array<double, 3> values{};
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto skipBlanks = [&] {
    while (at != end && (*at == ' ' || *at == '\t')) ++at;
  };
  for (std::size_t i = 0; i < values.size(); ++i) {
    skipBlanks();
    if (i > 0 && at != end && *at == ',') ++at;
    skipBlanks();
    if (at != end && *at == '+') ++at;
    const auto [next, error] = std::from_chars(at, end, values[i]);
    if (error != std::errc() || !std::isfinite(values[i])) return wrong();
    at = next;
  }
  skipBlanks();
  if (at != end) return wrong();
  return Vec3{values[0], values[1], values[2]};
}

Result<double> parseSmoothing(const std::string& text) {
  if (text == "auto") return rbf::kAutoSmoothing;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0) || !std::isfinite(value)) {
    return fail(ErrorCode::InvalidArgument,
                "--smoothing needs auto or a number from 0, not '" + text.substr(0, 40) + "'");
  }
  return value;
}

Result<store::Store> openStore(const std::string& data) {
  const auto folder = store::dataFolder(data);
  if (!folder) return tl::unexpected(folder.error());
  return store::Store::open(*folder);
}

}  // namespace spinaltap::cli
