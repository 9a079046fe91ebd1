#include "server/store/rows.h"

#include <nlohmann/json.hpp>

namespace spinaltap::store {
using nlohmann::json;

json toJson(const Vec3& v) { return json::array({v.x, v.y, v.z}); }

json toJson(const volume::Grid& grid) {
  return {{"dims", grid.dims},
          {"spacing_mm", toJson(grid.spacing_mm)},
          {"origin_patient", toJson(grid.origin_patient)},
          {"direction",
           json::array({toJson(grid.direction.col_x), toJson(grid.direction.col_y), toJson(grid.direction.col_z)})}};
}

json toJson(const plan::Bit& bit) {
  return {{"diameter_mm", bit.diameter_mm}, {"cone_length_mm", bit.cone_length_mm}, {"length_mm", bit.length_mm}};
}

json toJson(const point_volume::Lattice& lattice) {
  return {{"spacing_mm", lattice.spacing_mm},
          {"rings", lattice.rings},
          {"discs", lattice.discs},
          {"first_disc", lattice.first_disc}};
}

Vec3 vec3From(const json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

volume::Grid gridFrom(const json& j) {
  const json& direction = j.at("direction");
  return {j.at("dims").get<std::array<int, 3>>(), vec3From(j.at("spacing_mm")), vec3From(j.at("origin_patient")),
          Mat3{vec3From(direction.at(0)), vec3From(direction.at(1)), vec3From(direction.at(2))}};
}

plan::Bit bitFrom(const json& j) {
  return {j.at("diameter_mm").get<double>(), j.at("cone_length_mm").get<double>(), j.at("length_mm").get<double>()};
}

point_volume::Lattice latticeFrom(const json& j) {
  return {j.at("spacing_mm").get<double>(), j.at("rings").get<int>(), j.at("discs").get<int>(),
          j.at("first_disc").get<int>()};
}

}  // namespace spinaltap::store
