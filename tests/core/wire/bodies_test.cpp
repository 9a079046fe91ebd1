#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/random.h"
#include "core/wire/bytes.h"
#include "core/wire/mesh_message.h"
#include "core/wire/point_volume_message.h"
#include "core/wire/volume_message.h"
#include "tests/core/wire/golden.h"

namespace spinaltap::wire {
namespace {

using Bytes = std::vector<std::byte>;

void setU32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(value >> (8 * i));
}
void setF64(Bytes& bytes, std::size_t at, double value) {
  ByteWriter out;
  out.f64(value);
  std::copy(out.bytes().begin(), out.bytes().end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
}
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(MeshMessage, TheGoldenMeshIsTheTriangleThatTheContractNames) {
  const auto mesh = decodeMesh(golden().at("mesh"));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->vertices, (std::vector<Vec3>{{10, 20, 30}, {11, 20, 30}, {10, 21, 30.5}}));
  EXPECT_EQ(mesh->normals, std::vector<Vec3>(3, Vec3{0, 0, 1}));
  EXPECT_EQ(mesh->triangles, (std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}}));
  EXPECT_EQ(encodeMesh(*mesh), golden().at("mesh"));
}

TEST(MeshMessage, KeepsPositionsToAFloatOfTheBoxHoweverFarTheScannersOriginIs) {
  Random random(11);
  mesh::TriangleMesh mesh;
  for (int i = 0; i < 300; ++i) {
    mesh.vertices.push_back(Vec3{1e6, -1e6, 5e5} +
                            Vec3{random.uniform(-60, 60), random.uniform(-60, 60), random.uniform(-60, 60)});
    mesh.normals.push_back({0, 1, 0});
  }
  for (std::uint32_t i = 0; i + 2 < 300; i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
  const auto back = decodeMesh(encodeMesh(mesh));
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->triangles, mesh.triangles);
  // At most 61 mm from the origin: half a float's last place there is 2^-19 mm; adding 1e6 in double costs 2^-33 more.
  for (std::size_t i = 0; i < 300; ++i) EXPECT_LE(norm(back->vertices[i] - mesh.vertices[i]), 2e-6 * std::sqrt(3.0));
}

TEST(MeshMessage, AnEmptyMeshRoundTrips) {
  const auto back = decodeMesh(encodeMesh({}));
  ASSERT_TRUE(back.has_value());
  EXPECT_TRUE(back->vertices.empty());
}

TEST(MeshMessage, RefusesATriangleOfNoVertexANumberThatIsNotFiniteAndCountsThatLie) {
  const Bytes good = golden().at("mesh");
  Bytes bytes = good;
  setU32(bytes, bytes.size() - 4, 3);
  EXPECT_EQ(decodeMesh(bytes).error().message, "mesh: a triangle that names no vertex at byte 120");
  bytes = good;
  setU32(bytes, 40, 0x7fc00000u);
  EXPECT_FALSE(decodeMesh(bytes).has_value());
  bytes = good;
  setU32(bytes, 76 + 8, 0x7f800000u);
  EXPECT_FALSE(decodeMesh(bytes).has_value());
  bytes = good;
  setF64(bytes, 16, kNaN);
  EXPECT_FALSE(decodeMesh(bytes).has_value());
  for (const std::uint32_t lie : {0u, 2u, 4u, 0x15555556u, 0xffffffffu}) {
    bytes = good;
    setU32(bytes, 8, lie);
    EXPECT_EQ(decodeMesh(bytes).error().code, ErrorCode::Corrupt) << lie;
    bytes = good;
    setU32(bytes, 12, lie);
    EXPECT_EQ(decodeMesh(bytes).error().code, ErrorCode::Corrupt) << lie;
  }
  bytes = good;
  setU32(bytes, 4, 2);
  EXPECT_EQ(decodeMesh(bytes).error().code, ErrorCode::Unsupported);
}

TEST(VolumeMessage, TheGoldenVolumeIsTheFourVoxelsThatTheContractNames) {
  const auto volume = decodeVolume(golden().at("volume"));
  ASSERT_TRUE(volume.has_value()) << volume.error().message;
  EXPECT_EQ(volume->grid, (VolumeGrid{{2, 1, 2}, {0.5, 1, 2}, {-1, 2, 3}, {}}));
  EXPECT_EQ(volume->hu, (std::vector<std::int16_t>{-1024, 0, 300, 3071}));
  EXPECT_EQ(encodeVolume(volume->grid, volume->hu), golden().at("volume"));
}

TEST(VolumeMessage, RefusesDimensionsThatLieWithoutAllocatingForThem) {
  for (const std::uint32_t lie : {0u, 1u, 3u, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
    for (const std::size_t at : {8u, 16u}) {
      Bytes bytes = golden().at("volume");
      setU32(bytes, at, lie);
      EXPECT_EQ(decodeVolume(bytes).error().code, ErrorCode::Corrupt) << lie << " at " << at;
    }
  }
  Bytes bytes = golden().at("volume");
  for (const std::size_t at : {8u, 12u, 16u}) setU32(bytes, at, 0x7fffffffu);
  EXPECT_FALSE(decodeVolume(bytes).has_value());
}

TEST(VolumeMessage, RefusesASpacingOfZeroAndNumbersThatAreNotFinite) {
  for (const double bad : {0.0, -1.0, kNaN}) {
    Bytes bytes = golden().at("volume");
    setF64(bytes, 28, bad);
    EXPECT_FALSE(decodeVolume(bytes).has_value());
  }
  for (std::size_t at = 44; at < 140; at += 8) {
    Bytes bytes = golden().at("volume");
    setF64(bytes, at, kNaN);
    EXPECT_FALSE(decodeVolume(bytes).has_value()) << at;
  }
}

TEST(PointVolumeMessage, TheGoldenPointsAreThoseThatTheContractNames) {
  const auto volume = decodePointVolume(golden().at("point_volume"));
  ASSERT_TRUE(volume.has_value()) << volume.error().message;
  EXPECT_EQ(volume->lattice, (point_volume::Lattice{0.5, 2, 1, -1}));
  EXPECT_EQ(volume->alive, std::vector<std::uint64_t>{0x43});
  EXPECT_EQ(volume->density_mg_cm3, (std::vector<std::uint16_t>{0x100, 0x101, 0x102, 0x103, 0x104, 0x105, 0x106}));
  EXPECT_EQ(encodePointVolume(*volume), golden().at("point_volume"));
}

TEST(PointVolumeMessage, RefusesBitsPastTheLastPointLatticesThatAreNoneAndLengthsThatLie) {
  Bytes bytes = golden().at("point_volume");
  bytes[36] |= std::byte{0x80};
  EXPECT_EQ(decodePointVolume(bytes).error().message, "point volume: alive bits past the last point at byte 36");
  for (const std::uint32_t lie : {0u, 1u, 3u, 0x7fffffffu, 0xffffffffu}) {
    for (const std::size_t at : {16u, 20u}) {
      if (at == 20 && lie == 1) continue;  // that is the truth
      bytes = golden().at("point_volume");
      setU32(bytes, at, lie);
      EXPECT_FALSE(decodePointVolume(bytes).has_value()) << lie << " at " << at;
    }
  }
  for (const double bad : {0.0, -0.1, kNaN}) {
    bytes = golden().at("point_volume");
    setF64(bytes, 8, bad);
    EXPECT_FALSE(decodePointVolume(bytes).has_value());
  }
  bytes = golden().at("point_volume");
  setU32(bytes, 28, 2);
  EXPECT_FALSE(decodePointVolume(bytes).has_value());
}

TEST(PointVolumeMessage, RoundTripsARandomVolume) {
  Random random(20020403);
  auto volume = point_volume::solidVolume({0.1, 9, 13, -4}, 0).value();
  for (std::uint64_t& word : volume.alive) word &= random.bits();
  for (std::uint16_t& density : volume.density_mg_cm3) density = static_cast<std::uint16_t>(random.bits());
  const auto back = decodePointVolume(encodePointVolume(volume));
  ASSERT_TRUE(back.has_value()) << back.error().message;
  EXPECT_EQ(back->lattice, volume.lattice);
  EXPECT_EQ(back->alive, volume.alive);
  EXPECT_EQ(back->density_mg_cm3, volume.density_mg_cm3);
}

TEST(Bodies, CutAnywhereOrWithAByteTooManyTheyAreRefused) {
  for (const char* name : {"mesh", "volume", "point_volume"}) {
    Bytes bytes = golden().at(name);
    bytes.push_back(std::byte{0});
    for (std::size_t size = 0; size <= bytes.size(); ++size) {
      const std::span<const std::byte> cut(bytes.data(), size);
      if (size == bytes.size() - 1) continue;
      EXPECT_FALSE(decodeMesh(cut).has_value()) << name << " of " << size;
      EXPECT_FALSE(decodeVolume(cut).has_value()) << name << " of " << size;
      EXPECT_FALSE(decodePointVolume(cut).has_value()) << name << " of " << size;
    }
  }
}

TEST(Bodies, RandomBytesBehindAGoodMagicNeverCrash) {
  Random random(20020404);
  int accepted = 0;
  for (int i = 0; i < 100000; ++i) {
    const char* names[] = {"mesh", "volume", "point_volume"};
    Bytes bytes = golden().at(names[random.below(3)]);
    for (std::uint64_t n = random.below(4); n > 0; --n) {
      bytes[random.below(bytes.size())] = static_cast<std::byte>(random.bits());
    }
    accepted += decodeMesh(bytes).has_value() + decodeVolume(bytes).has_value() + decodePointVolume(bytes).has_value();
  }
  EXPECT_GT(accepted, 25000);
}

}  // namespace
}  // namespace spinaltap::wire
