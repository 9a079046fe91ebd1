#include "core/tradeoff/haptic_tradeoff.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "core/base/parallel.h"

namespace spinaltap::tradeoff {
namespace {

constexpr std::array kBones{Bone::Cortex, Bone::Cancellous, Bone::ThroughTheWall};
using haptics::kHoldings;

Result<void> checkAll(const std::vector<double>& values, std::size_t most, double low, double high,
                      const std::string& what, const std::string& range) {
  const auto refuse = [&](const std::string& why) { return fail(ErrorCode::InvalidArgument, "trade-off: " + why); };
  if (values.empty() || values.size() > most) {
    return refuse(std::to_string(values.size()) + " " + what + "s, not 1 to " + std::to_string(most));
  }
  for (auto at = values.begin(); at != values.end(); ++at) {
    if (!(*at >= low && *at <= high)) return refuse(std::string(what).append(" is not ").append(range));
    if (std::find(values.begin(), at, *at) != at) return refuse("the same " + what + " twice");
  }
  return {};
}

/// Every rate and network, as answered and extrapolated.
std::vector<HapticCase> settingsOf(const HapticGrid& grid) {
  std::vector<HapticCase> settings;
  for (const double rate : grid.rates_hz) {
    for (const Network& network : networksOf(grid)) {
      for (const bool extrapolate : {false, true}) {
        HapticCase setting;
        setting.rate_hz = rate;
        setting.delay_ms = network.delay_ms, setting.jitter_ms = network.jitter_ms, setting.loss = network.loss;
        setting.extrapolate = extrapolate;
        setting.seconds = grid.seconds;
        settings.push_back(setting);
      }
    }
  }
  return settings;
}

/// Calls measure(n) -> Result<Value> for n from 0 to count on the grid's threads; the values in order, or the first
/// error.
template <class Value, class Measure>
Result<std::vector<Value>> measured(std::size_t count, unsigned threads, const Measure& measure) {
  std::vector<std::optional<Result<Value>>> slots(count);
  parallelBlocks(count, 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) slots[n].emplace(measure(n));
  });
  std::vector<Value> values;
  values.reserve(count);
  for (auto& slot : slots) {
    if (!*slot) return tl::unexpected(slot->error());
    values.push_back(std::move(**slot));
  }
  return values;
}

}  // namespace

Result<void> checkGrid(const HapticGrid& grid) {
  if (auto checked = checkAll(grid.rates_hz, kMostRates, 50, 20'000, "rate", "50 to 20000 Hz"); !checked)
    return checked;
  if (auto checked = checkAll(grid.delays_ms, kMostDelays, 0, 1000, "delay", "0 to 1000 ms"); !checked) return checked;
  if (auto checked = checkAll({grid.jitter_ms}, 1, 0, 1000, "jitter", "0 to 1000 ms"); !checked) return checked;
  if (auto checked = checkAll({grid.loss}, 1, 0, 0.9, "loss", "0 to 0.9"); !checked) return checked;
  return checkAll({grid.seconds}, 1, 0.5, 10, "length", "0.5 to 10 s");
}

std::vector<Network> networksOf(const HapticGrid& grid) {
  std::vector<Network> networks;
  for (const double delay : grid.delays_ms) networks.push_back({delay, 0, 0});
  std::sort(networks.begin(), networks.end(),
            [](const Network& a, const Network& b) { return a.delay_ms < b.delay_ms; });
  if (grid.jitter_ms > 0 || grid.loss > 0) {
    networks.push_back({networks[networks.size() / 2].delay_ms, grid.jitter_ms, grid.loss});
  }
  return networks;
}

Result<std::vector<HapticMeasured>> measureHaptics(const HapticGrid& grid, const HapticProgress& progress) {
  if (const auto checked = checkGrid(grid); !checked) return tl::unexpected(checked.error());
  const std::vector<HapticCase> settings = settingsOf(grid);
  const std::size_t hands = kBones.size() * kHoldings.size();
  const auto settingOf = [&](std::size_t hand, HapticCase setting) {
    setting.bone = kBones[hand / kHoldings.size()], setting.holding = kHoldings[hand % kHoldings.size()];
    setting.coupling = couplingOf(setting.holding, setting.rate_hz);
    return setting;
  };
  // Of each hand one a coupling, which several rates may share.
  std::vector<HapticCase> ideal_cases;
  const auto idealOf = [&](const HapticCase& setting) {
    return std::find_if(ideal_cases.begin(), ideal_cases.end(), [&](const HapticCase& c) {
      return c.bone == setting.bone && c.holding == setting.holding && c.coupling == setting.coupling;
    });
  };
  for (std::size_t hand = 0; hand < hands; ++hand) {
    for (const HapticCase& setting : settings) {
      if (idealOf(settingOf(hand, setting)) == ideal_cases.end()) ideal_cases.push_back(settingOf(hand, setting));
    }
  }
  const auto ideals =
      measured<Course>(ideal_cases.size(), grid.threads, [&](std::size_t n) { return idealCourse(ideal_cases[n]); });
  if (!ideals) return tl::unexpected(ideals.error());

  std::vector<HapticMeasured> rows;
  rows.reserve(hands * settings.size());
  for (std::size_t hand = 0; hand < hands; ++hand) {
    if (progress) progress(static_cast<double>(hand + 1) / static_cast<double>(hands + 1));
    const auto of_hand =
        measured<HapticMeasured>(settings.size(), grid.threads, [&](std::size_t n) -> Result<HapticMeasured> {
          const HapticCase setting = settingOf(hand, settings[n]);
          const auto ideal = static_cast<std::size_t>(idealOf(setting) - ideal_cases.begin());
          const auto result = runLoop(setting, (*ideals)[ideal]);
          if (!result) return tl::unexpected(result.error());
          return HapticMeasured{setting, *result};
        });
    if (!of_hand) return tl::unexpected(of_hand.error());
    rows.insert(rows.end(), of_hand->begin(), of_hand->end());
  }
  return rows;
}

Result<std::vector<StiffestMeasured>> measureStiffest(const HapticGrid& grid, const HapticProgress& progress) {
  if (const auto checked = checkGrid(grid); !checked) return tl::unexpected(checked.error());
  const std::vector<HapticCase> settings = settingsOf(grid);
  const std::size_t a_rate = 2 * settings.size() / grid.rates_hz.size();
  std::vector<StiffestMeasured> rows;
  for (std::size_t rate = 0; rate < grid.rates_hz.size(); ++rate) {
    if (progress) progress(static_cast<double>(rate) / static_cast<double>(grid.rates_hz.size()));
    const auto of_rate =
        measured<StiffestMeasured>(a_rate, grid.threads, [&](std::size_t n) -> Result<StiffestMeasured> {
          HapticCase setting = settings[(rate * a_rate + n) / 2];
          setting.guard = n % 2 == 1;
          const auto stiffest = stiffestStable_N_mm(setting);
          if (!stiffest) return tl::unexpected(stiffest.error());
          return StiffestMeasured{
              setting, *stiffest,
              haptics::stiffestCoupling_N_mm(haptics::relaxedGrip().damping_N_s_mm, 1 / setting.rate_hz, 0)};
        });
    if (!of_rate) return tl::unexpected(of_rate.error());
    rows.insert(rows.end(), of_rate->begin(), of_rate->end());
  }
  return rows;
}

Result<ForceCourses> forceCourses(HapticCase haptic_case) {
  const auto ideal = idealCourse(haptic_case);
  if (!ideal) return tl::unexpected(ideal.error());
  ForceCourses courses;
  for (const bool extrapolate : {false, true}) {
    haptic_case.extrapolate = extrapolate;
    const auto run = runLoop(haptic_case, *ideal, extrapolate ? &courses.extrapolated : &courses.answered);
    if (!run) return tl::unexpected(run.error());
  }
  const std::size_t samples = courses.answered.t_s.size();
  const std::size_t each = samples > 0 ? ideal->force_N.size() / samples : 0;  // of the reference's ticks
  for (std::size_t n = 0; n < samples; ++n) courses.ideal_N.push_back(-ideal->force_N[n * each]);
  return courses;
}

}  // namespace spinaltap::tradeoff
