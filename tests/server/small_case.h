// tests/server/small_case.h - a reconstructed case with a path, made in milliseconds: bone is the half-space z > 0.
#pragma once
#include <gtest/gtest.h>

#include "core/wire/mesh_message.h"
#include "server/jobs/codec.h"
#include "server/jobs/plan_job.h"
#include "server/store/store.h"

namespace spinaltap::test {

struct SmallCase {
  std::string case_id, path_id;
  store::Path path;
};

inline plan::Path smallPath() {
  plan::Path path;
  path.entry_patient = {0, 0, 0};
  path.target_patient = {0, 0, 6};
  path.volume_radius_mm = 2.5;
  path.lead_mm = 1;
  path.spacing_mm = 0.25;
  path.bit.length_mm = 20;
  return path;
}

inline SmallCase makeSmallCase(store::Store& store) {
  volume::CtVolume ct;
  ct.grid.dims = {12, 12, 20};
  ct.grid.origin_patient = {-6, -6, -5};
  ct.hu.assign(ct.grid.voxels(), 300);
  volume::LabelVolume label{ct.grid, std::vector<std::uint8_t>(ct.grid.voxels(), 1)};
  rbf::Model model;
  model.linear = {0, 0, -1};
  mesh::TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals.assign(3, {0, 0, -1});
  mesh.triangles = {{0, 2, 1}};

  store::Case row;
  row.label = "small";
  row.grid = ct.grid;
  row.ct = store.blobs().put(jobs::encodeCt(ct)).value();
  const std::string id = store.addCase(row).value().id;
  EXPECT_TRUE(store.setLabel(id, store.blobs().put(jobs::encodeLabel(label)).value(), "segmented").has_value());
  const store::Reconstruction made{store.blobs().put(jobs::encodeCt(ct), store::Gzip::Sibling).value(),
                                   store.blobs().put(jobs::encodeModel(model)).value(),
                                   store.blobs().put(wire::encodeMesh(mesh), store::Gzip::Sibling).value(),
                                   "{\"centres\":0}"};
  EXPECT_TRUE(store.setReconstruction(id, made).has_value());
  const store::Path path = jobs::planPath(store, {id, "straight", smallPath()}, {}).value();
  return {id, path.id, path};
}

}  // namespace spinaltap::test
