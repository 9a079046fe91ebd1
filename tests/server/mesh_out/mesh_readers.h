// tests/server/mesh_out/mesh_readers.h - STL and PLY read by nothing of the writer's: bytes copied into numbers.
#pragma once
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace spinaltap::test {

/// The test machine is little-endian, as the files are.
class Cursor {
 public:
  Cursor(std::span<const std::byte> bytes, std::size_t at) : bytes_(bytes), at_(at) {}
  template <class T>
  T next() {
    T value{};
    if (at_ + sizeof(T) > bytes_.size()) {
      ADD_FAILURE() << "ends at byte " << at_;
      return value;
    }
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  Vec3 floats() {
    const float x = next<float>(), y = next<float>(), z = next<float>();
    return {x, y, z};
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_;
};

struct ReadMesh {
  std::string head;
  mesh::TriangleMesh mesh;
  std::vector<Vec3> facet_normals;
};

/// Equal places become one vertex, as every reader of STL does.
inline ReadMesh readStl(std::span<const std::byte> bytes) {
  ReadMesh out;
  out.head.assign(reinterpret_cast<const char*>(bytes.data()), 80);
  Cursor in(bytes, 80);
  const auto count = in.next<std::uint32_t>();
  std::map<std::tuple<double, double, double>, std::uint32_t> known;
  for (std::uint32_t t = 0; t < count; ++t) {
    out.facet_normals.push_back(in.floats());
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint32_t& v : triangle) {
      const Vec3 p = in.floats();
      const auto [found, made] =
          known.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(out.mesh.vertices.size()));
      if (made) out.mesh.vertices.push_back(p);
      v = found->second;
    }
    out.mesh.triangles.push_back(triangle);
    EXPECT_EQ(in.next<std::uint16_t>(), 0);
  }
  EXPECT_EQ(in.left(), 0U);
  return out;
}

/// Only what the head declares: its properties give the fields' order and types.
inline ReadMesh readPly(std::span<const std::byte> bytes) {
  ReadMesh out;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t end = text.find("end_header\n");
  if (end == std::string_view::npos) {
    ADD_FAILURE() << "no end of the head";
    return out;
  }
  out.head = text.substr(0, end);
  std::size_t vertices = 0, faces = 0;
  std::vector<std::string> types;  // of a vertex's properties
  std::istringstream lines(out.head);
  for (std::string line, element; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first, second;
    words >> first >> second;
    if (first == "element") words >> (second == "vertex" ? vertices : faces), element = second;
    if (first == "property" && element == "vertex") types.push_back(second);
  }
  Cursor in(bytes, end + std::strlen("end_header\n"));
  for (std::size_t v = 0; v < vertices; ++v) {
    std::vector<double> fields;
    for (const std::string& type : types) fields.push_back(type == "double" ? in.next<double>() : in.next<float>());
    fields.resize(6);
    out.mesh.vertices.push_back({fields[0], fields[1], fields[2]});
    out.mesh.normals.push_back({fields[3], fields[4], fields[5]});
  }
  for (std::size_t f = 0; f < faces; ++f) {
    EXPECT_EQ(in.next<std::uint8_t>(), 3);
    const auto a = in.next<std::uint32_t>(), b = in.next<std::uint32_t>(), c = in.next<std::uint32_t>();
    out.mesh.triangles.push_back({a, b, c});
  }
  EXPECT_EQ(in.left(), 0U);
  return out;
}

}  // namespace spinaltap::test
