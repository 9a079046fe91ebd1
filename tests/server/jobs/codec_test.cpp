#include "server/jobs/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/base/random.h"

namespace spinaltap::jobs {
namespace {

rbf::Model exampleModel() {
  rbf::Model model;
  Random random(11);
  model.centroid_patient = {1e5 / 3, -2, 3};
  model.radius_mm = 77.7;
  model.constant = std::numeric_limits<double>::denorm_min();
  model.linear = {0.1, 0.2, -0.3};
  for (int i = 0; i < 50; ++i) {
    model.centres.push_back({random.gaussian(), random.gaussian(), random.gaussian()});
    model.weights.push_back(random.gaussian());
  }
  return model;
}

volume::LabelVolume exampleLabel(std::uint64_t seed) {
  volume::LabelVolume label;
  label.grid.dims = {7, 5, 3};
  label.grid.spacing_mm = {0.3, 0.3, 1.0 / 3};
  Random random(seed);
  for (std::size_t i = 0; i < label.grid.voxels(); ++i) label.inside.push_back(random.below(2) != 0 ? 1 : 0);
  return label;
}

TEST(ModelCodec, KeepsEveryBit) {
  const rbf::Model model = exampleModel(), back = decodeModel(encodeModel(model)).value();
  EXPECT_EQ(back.centroid_patient, model.centroid_patient);
  EXPECT_EQ(back.radius_mm, model.radius_mm);
  EXPECT_EQ(back.constant, model.constant);
  EXPECT_EQ(back.linear, model.linear);
  EXPECT_EQ(back.centres, model.centres);
  EXPECT_EQ(back.weights, model.weights);
}

TEST(ModelCodec, StillReadsTheFirstVersionWhichHadNoRadius) {
  const rbf::Model model = exampleModel();
  std::vector<std::byte> bytes = encodeModel(model);
  bytes[4] = std::byte{1};
  bytes.erase(bytes.begin() + 32, bytes.begin() + 40);  // behind magic, version and centroid
  const rbf::Model back = decodeModel(bytes).value();
  EXPECT_EQ(back.radius_mm, 0);
  EXPECT_EQ(back.constant, model.constant);
  EXPECT_EQ(back.centres, model.centres);
}

TEST(ModelCodec, RefusesVersionsItDoesNotKnow) {
  std::vector<std::byte> bytes = encodeModel(exampleModel());
  bytes[4] = std::byte{3};
  EXPECT_EQ(decodeModel(bytes).error().code, ErrorCode::Unsupported);
}

TEST(ModelCodec, RefusesEveryTruncation) {
  const auto bytes = encodeModel(exampleModel());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decodeModel({bytes.data(), size}).has_value()) << size;
  }
}

TEST(ModelCodec, ItsBoundHoldsBetweenRandomPoints) {
  const rbf::Model model = exampleModel();
  const double bound = lipschitzOf(model);
  Random random(12);
  for (int i = 0; i < 1000; ++i) {
    const auto point = [&] {
      return model.centroid_patient + Vec3{random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)};
    };
    const std::vector<Vec3> points{point(), point()};
    std::vector<double> values(2);
    rbf::evaluate(model, points, values);
    EXPECT_LE(std::abs(values[0] - values[1]), bound * norm(points[0] - points[1]));
  }
}

TEST(LabelCodec, GivesBackRandomLabels) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto label = exampleLabel(seed), back = decodeLabel(encodeLabel(label)).value();
    EXPECT_EQ(back.grid, label.grid) << "seed " << seed;
    EXPECT_EQ(back.inside, label.inside) << "seed " << seed;
  }
}

TEST(LabelCodec, RefusesEveryTruncationAndAnyOtherLength) {
  const auto bytes = encodeLabel(exampleLabel(1));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decodeLabel({bytes.data(), size}).has_value()) << size;
  }
  auto longer = bytes;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decodeLabel(longer).has_value());
  auto last_run = bytes;
  last_run[bytes.size() - 4] ^= std::byte{1};  // one voxel more or less than the grid has
  EXPECT_FALSE(decodeLabel(last_run).has_value());
}

TEST(CtCodec, KeepsGridAndHu) {
  volume::CtVolume ct;
  ct.grid.dims = {3, 2, 2};
  ct.grid.direction = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  for (int i = 0; i < 12; ++i) ct.hu.push_back(static_cast<std::int16_t>(i * 500 - 3000));
  const auto back = decodeCt(encodeCt(ct)).value();
  EXPECT_EQ(back.grid, ct.grid);
  EXPECT_EQ(back.hu, ct.hu);
}

}  // namespace
}  // namespace spinaltap::jobs
