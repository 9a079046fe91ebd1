#include "server/cli/output.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace spinaltap::cli {
namespace {

constexpr auto kRedrawEvery = std::chrono::milliseconds(100);

constexpr std::size_t kMostShown = 12;  // values of a list on one line

std::string shown(const jobs::Figures& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_array() && value.size() > kMostShown) {
    const jobs::Figures first(value.begin(), value.begin() + kMostShown);
    std::string text = shown(first);
    text.back() = ',';
    return text + "... " + std::to_string(value.size()) + " in all]";
  }
  return value.dump(-1, ' ', false, jobs::Figures::error_handler_t::replace);
}

void printRows(const jobs::Figures& rows) {
  for (const auto& row : rows) {
    std::string line;
    for (const auto& [key, value] : row.items()) {
      if (value.is_primitive()) line += "  " + key + "=" + shown(value);
    }
    std::puts(line.c_str());
  }
}

}  // namespace

void print(const jobs::Figures& figures, bool json) {
  if (json) {
    std::puts(figures.dump(-1, ' ', false, jobs::Figures::error_handler_t::replace).c_str());
    return;
  }
  std::size_t width = 0;
  for (const auto& [key, value] : figures.items()) width = std::max(width, key.size());
  for (const auto& [key, value] : figures.items()) {
    const bool rows = value.is_array() && !value.empty() && value.front().is_object();
    const std::string text = rows ? "" : shown(value);
    std::printf("%-*s  %s\n", static_cast<int>(width), key.c_str(), text.c_str());
    if (rows) printRows(value);
  }
}

void printError(std::string_view message) {
  std::string line(message);
  std::replace_if(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  std::fprintf(stderr, "spinaltap: %s\n", line.c_str());
}

ProgressBar::ProgressBar() : terminal_(::isatty(STDERR_FILENO) != 0) {}

void ProgressBar::show(std::string_view stage, double fraction) {
  if (!terminal_) return;
  const auto now = std::chrono::steady_clock::now();
  if (stage == stage_ && now - last_ < kRedrawEvery) return;
  last_ = now;
  stage_ = stage;
  drawn_ = true;
  constexpr int kWidth = 40;
  const int full = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * kWidth);
  std::string bar(static_cast<std::size_t>(full), '#');
  bar.resize(kWidth, '.');
  std::fprintf(stderr, "\r\033[K%-10s [%s] %3d %%", stage_.c_str(), bar.c_str(), full * 100 / kWidth);
}

void ProgressBar::wipe() {
  if (drawn_) std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

jobs::Progress ProgressBar::callback() {
  return [this](std::string_view stage, double fraction) { show(stage, fraction); };
}

}  // namespace spinaltap::cli
