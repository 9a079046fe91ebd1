#include "server/mesh_out/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

namespace spinaltap::mesh_out {
namespace {

constexpr std::size_t kMost = 0x7fffffff;
constexpr double kMostForStl_mm = 8192;  // from there on, neighbouring floats are 2^-10 mm apart

class Writer {
 public:
  explicit Writer(std::size_t size) { bytes_.reserve(size); }

  void text(std::string_view s) {
    for (const char c : s) bytes_.push_back(static_cast<std::byte>(c));
  }
  /// Little-endian, whatever the machine.
  template <class Unsigned>
  void number(Unsigned value) {
    for (std::size_t n = 0; n < sizeof(Unsigned); ++n)
      bytes_.push_back(static_cast<std::byte>(value >> (8 * n) & 0xff));
  }
  void f32(double value) {
    const auto narrow = static_cast<float>(value);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &narrow, sizeof bits);
    number(bits);
  }
  void f64(double value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    number(bits);
  }
  void vec32(const Vec3& v) { f32(v.x), f32(v.y), f32(v.z); }
  void vec64(const Vec3& v) { f64(v.x), f64(v.y), f64(v.z); }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

Vec3 facetNormal(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = cross(b - a, c - a);
  return norm(n) > 0 ? normalized(n) : Vec3{};  // zero: "the reader works it out"
}

std::vector<std::byte> encodeStl(const mesh::TriangleMesh& mesh) {
  Writer out(84 + 50 * mesh.triangles.size());
  std::string head = "SpinalTap: binary STL, millimetres, patient frame LPS (x left, y back, z head)";
  head.resize(80, ' ');  // and it does not begin with "solid", which would mean text
  out.text(head);
  out.number(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    out.vec32(facetNormal(a, b, c));
    out.vec32(a), out.vec32(b), out.vec32(c);
    out.number(std::uint16_t{0});
  }
  return out.take();
}

std::vector<std::byte> encodePly(const mesh::TriangleMesh& mesh) {
  const bool normals = !mesh.normals.empty();
  std::string head =
      "ply\nformat binary_little_endian 1.0\n"
      "comment SpinalTap: millimetres, patient frame LPS (x left, y back, z head)\n"
      "element vertex " +
      std::to_string(mesh.vertices.size()) + "\nproperty double x\nproperty double y\nproperty double z\n";
  if (normals) head += "property float nx\nproperty float ny\nproperty float nz\n";
  head += "element face " + std::to_string(mesh.triangles.size()) +
          "\nproperty list uchar int vertex_indices\nend_header\n";
  Writer out(head.size() + 36 * mesh.vertices.size() + 13 * mesh.triangles.size());
  out.text(head);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    out.vec64(mesh.vertices[v]);
    if (normals) out.vec32(mesh.normals[v]);
  }
  for (const auto& t : mesh.triangles) {
    out.number(std::uint8_t{3});
    for (const std::uint32_t v : t) out.number(v);
  }
  return out.take();
}

}  // namespace

Result<Format> formatNamed(std::string_view name) {
  if (name == "stl") return Format::Stl;
  if (name == "ply") return Format::Ply;
  return fail(ErrorCode::InvalidArgument,
              "mesh formats are stl and ply, not '" + std::string(name.substr(0, 20)) + "'");
}

const char* nameOf(Format format) { return format == Format::Stl ? "stl" : "ply"; }

const char* mediaTypeOf(Format format) { return format == Format::Stl ? "model/stl" : "application/octet-stream"; }

Result<std::vector<std::byte>> encode(const mesh::TriangleMesh& mesh, Format format) {
  if (mesh.triangles.size() > kMost || mesh.vertices.size() > kMost) {
    return fail(ErrorCode::Limit, "the mesh has more triangles than its file format can count");
  }
  if (format == Format::Ply) return encodePly(mesh);
  for (const Vec3& v : mesh.vertices) {
    const double farthest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(farthest < kMostForStl_mm)) {
      return fail(ErrorCode::Limit,
                  "the mesh lies more than 8 m from the origin, where STL's single precision is too "
                  "coarse: take PLY");
    }
  }
  return encodeStl(mesh);
}

}  // namespace spinaltap::mesh_out
