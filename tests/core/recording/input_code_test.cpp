#include "core/recording/input_code.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/session/scenes.h"
#include "tests/core/recording/drills.h"

namespace spinaltap::recording {
namespace {

using Inputs = std::vector<session::Input>;

/// Chunk by chunk, as writer and reader do; the bytes all chunks took.
std::size_t thereAndBack(const Inputs& inputs, std::size_t chunk, Inputs& back) {
  std::size_t bytes = 0;
  back.clear();
  for (std::size_t begin = 0; begin < inputs.size(); begin += chunk) {
    const std::size_t count = std::min(chunk, inputs.size() - begin);
    wire::ByteWriter out;
    encodeInputs(std::span(inputs).first(begin), std::span(inputs).subspan(begin, count), out);
    EXPECT_TRUE(decodeInputs(out.bytes(), count, back)) << begin;
    bytes += out.bytes().size();
  }
  return bytes;
}

void expectSameBits(const Inputs& inputs, std::size_t chunk = 1000) {
  Inputs back;
  thereAndBack(inputs, chunk, back);
  ASSERT_EQ(back.size(), inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) ASSERT_TRUE(sameBits(back[i], inputs[i])) << i;
}

double anyDouble(Random& random) {
  double value = 0;
  const std::uint64_t bits = random.bits();
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

TEST(InputCode, BringsBackAnyBitsAtAll) {
  Random random(20021101);
  for (int run = 0; run < 30; ++run) {
    Inputs inputs(random.below(200) + 1);
    for (session::Input& input : inputs) {
      input.t_us = random.bits();
      input.tip_mm = {anyDouble(random), anyDouble(random), anyDouble(random)};
      input.axis = {anyDouble(random), anyDouble(random), anyDouble(random)};
      input.spinning = random.below(2) == 0;
    }
    expectSameBits(inputs, random.below(60) + 1);
  }
}

TEST(InputCode, BringsBackEverySpecialNumberInTheMiddleOfASmoothMotion) {
  const double infinite = std::numeric_limits<double>::infinity(), least = std::numeric_limits<double>::denorm_min();
  const double special[] = {0.0,
                            -0.0,
                            infinite,
                            -infinite,
                            least,
                            -least,
                            nanWithPayload(0),
                            nanWithPayload(0x123456789abcull),
                            -nanWithPayload(1),
                            std::numeric_limits<double>::max(),
                            std::numeric_limits<double>::lowest(),
                            std::numeric_limits<double>::min() / 3};
  Inputs inputs;
  for (std::size_t i = 0; i < 1200; ++i) inputs.push_back(session::sceneInput(session::Scene::Hand, i));
  Random random(20021102);
  for (std::size_t i = 0; i < 300; ++i) {
    session::Input& input = inputs[random.below(inputs.size())];
    double* const fields[] = {&input.tip_mm.x, &input.tip_mm.y, &input.tip_mm.z,
                              &input.axis.x,   &input.axis.y,   &input.axis.z};
    *fields[random.below(6)] = special[random.below(12)];
    if (random.below(8) == 0) input.t_us = random.bits();
  }
  expectSameBits(inputs);
  expectSameBits(inputs, 1);
  expectSameBits(inputs, 7);
}

TEST(InputCode, BringsBackStepsOfANanometre) {
  Inputs inputs(1000);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    inputs[i].t_us = 1000 * i, inputs[i].tip_mm = {0.1, -0.2, 1e-6 * static_cast<double>(i)};
  }
  expectSameBits(inputs);
}

/// Two thirds of the 20 bytes that a sample may take, since its check and the discs' sums come on top.
TEST(InputCode, TakesUnderThirteenBytesASampleInAHandAndUnderOneOnTheAxis) {
  for (const session::Scene scene : {session::Scene::On, session::Scene::Off, session::Scene::Hand}) {
    Inputs inputs, back;
    for (std::size_t i = 0; i < 5000; ++i) inputs.push_back(session::sceneInput(scene, i));
    const std::size_t bytes = thereAndBack(inputs, 1000, back);
    EXPECT_LT(bytes, (scene == session::Scene::Hand ? 13u : 1u) * inputs.size()) << session::nameOf(scene);
    ASSERT_EQ(back.size(), inputs.size());
    for (std::size_t i = 0; i < inputs.size(); ++i) ASSERT_TRUE(sameBits(back[i], inputs[i])) << i;
  }
}

TEST(InputCode, OfADeviceThatReportsFloatsSparesTheBitsThatFloatsLack) {
  Random random(20021103);
  Inputs inputs, back;
  for (std::size_t i = 0; i < 3000; ++i) {
    session::Input input = session::sceneInput(session::Scene::Hand, i);
    for (double* v : {&input.tip_mm.x, &input.tip_mm.y, &input.tip_mm.z, &input.axis.x, &input.axis.y, &input.axis.z}) {
      *v = static_cast<float>(*v + 1e-3 * random.gaussian());
    }
    inputs.push_back(input);
  }
  EXPECT_LT(thereAndBack(inputs, 1000, back), 22 * inputs.size()) << "six floats are 24";
  for (std::size_t i = 0; i < inputs.size(); ++i) ASSERT_TRUE(sameBits(back[i], inputs[i])) << i;
}

TEST(InputCode, RefusesACodeThatIsCutOrTooLong) {
  const Inputs inputs = mixedInputs(50);
  wire::ByteWriter out;
  encodeInputs({}, inputs, out);
  const auto& code = out.bytes();
  Inputs back;
  ASSERT_TRUE(decodeInputs(code, inputs.size(), back));
  for (std::size_t size = 0; size < code.size(); ++size) {
    back.clear();
    EXPECT_FALSE(decodeInputs(std::span(code).first(size), inputs.size(), back)) << size;
  }
  auto longer = code;
  longer.push_back(std::byte{0});
  back.clear();
  EXPECT_FALSE(decodeInputs(longer, inputs.size(), back));
}

TEST(InputCode, OfRandomBytesNeverCrashes) {
  Random random(20021104);
  for (int run = 0; run < 20000; ++run) {
    std::vector<std::byte> code(random.below(120));
    for (std::byte& b : code) b = static_cast<std::byte>(random.below(4) == 0 ? 0xff : random.bits());
    Inputs back = mixedInputs(3);
    (void)decodeInputs(code, random.below(40) + 1, back);
    EXPECT_LE(back.size(), 43u);
  }
}

}  // namespace
}  // namespace spinaltap::recording
