// tests/core/recording/drills.h - small drills to record, with every kind of input.
#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "core/base/random.h"
#include "core/recording/recording.h"

namespace spinaltap::recording {

inline double nanWithPayload(std::uint64_t payload) {
  const std::uint64_t bits = 0x7ff8000000000000ull | payload;
  double v = 0;
  std::memcpy(&v, &bits, sizeof v);
  return v;
}

/// Half a mm across, ragged, with densities that do and do not run.
inline point_volume::PointVolume smallVolume() {
  Random random(20020410);
  auto volume = point_volume::solidVolume({0.1, 4, 9, -2}, 300).value();
  for (std::uint64_t& word : volume.alive) word &= random.bits() | random.bits() | random.bits();
  for (std::size_t i = 100; i < 150; ++i) volume.density_mg_cm3[i] = static_cast<std::uint16_t>(random.below(1500));
  return volume;
}

inline Header smallHeader() { return {"0.1.0", "c7k2m9xq", "p1", "", {{0.5, 0.4, 5.0}, "reference"}}; }

/// Goes in and wanders; one input in eight is refused for one reason or another, or does not spin.
inline std::vector<session::Input> mixedInputs(std::size_t count, std::uint64_t seed = 20020411) {
  Random random(seed);
  std::vector<session::Input> inputs;
  for (std::size_t i = 0; i < count; ++i) {
    session::Input input{1000 * i, {random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 0}, {0, 0, 1}, true};
    input.tip_mm.z = -0.3 + 1.2 * static_cast<double>(i) / static_cast<double>(count);
    input.axis = {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 2};
    switch (random.below(32)) {
      case 0:
        input.tip_mm.y = nanWithPayload(0x123456789abcull);
        break;
      case 1:
        input.axis = {0, -0.0, 0};
        break;
      case 2:
        input.t_us = 0;
        break;
      case 3:
        input.spinning = false;
        break;
      default:
        break;
    }
    inputs.push_back(input);
  }
  return inputs;
}

struct Recorded {
  std::vector<std::byte> bytes;
  std::uint64_t final_hash = 0, accepted = 0;
  std::vector<std::size_t> sink_sizes;  ///< bytes there were after each call of the sink
};

/// Steps a session through the inputs, recording; flushes after every `flush_every` inputs (0: never).
inline Recorded record(const std::vector<session::Input>& inputs, std::size_t flush_every = 0, bool finish = true) {
  Recorded recorded;
  auto writer = Writer::begin(smallHeader(), smallVolume(), [&](std::span<const std::byte> bytes) {
                  recorded.bytes.insert(recorded.bytes.end(), bytes.begin(), bytes.end());
                  recorded.sink_sizes.push_back(recorded.bytes.size());
                  return true;
                }).value();
  auto session = session::Session::create(smallVolume(), smallHeader().config).value();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::vector<std::uint32_t> removed;
    const session::Output output = session.step(inputs[i], [&](std::span<const std::uint32_t> some) {
      removed.insert(removed.end(), some.begin(), some.end());
    });
    EXPECT_TRUE(writer.append(inputs[i], output, removed, session.volume()).has_value());
    recorded.final_hash = output.state_hash;
    recorded.accepted = output.cycle;
    if (flush_every > 0 && (i + 1) % flush_every == 0) {
      EXPECT_TRUE(writer.flush().has_value());
    }
  }
  if (finish) {
    EXPECT_TRUE(writer.finish().has_value());
  }
  return recorded;
}

inline bool sameBits(const session::Input& a, const session::Input& b) {
  return a.t_us == b.t_us && a.spinning == b.spinning && std::memcmp(&a.tip_mm, &b.tip_mm, sizeof a.tip_mm) == 0 &&
         std::memcmp(&a.axis, &b.axis, sizeof a.axis) == 0;
}

}  // namespace spinaltap::recording
