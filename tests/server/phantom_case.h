// tests/server/phantom_case.h - a labelled case, small and made in memory: nothing is reconstructed yet.
#pragma once
#include <gtest/gtest.h>

#include <string>

#include "core/phantom/ct.h"
#include "server/jobs/codec.h"
#include "server/store/store.h"

namespace spinaltap::test {

/// The phantom in voxels four times wider, with its true label; returns the case's id.
inline std::string phantomCase(store::Store& store) {
  const auto truth = phantom::Phantom::make({});
  const auto ct = phantom::sampleCt(truth, phantom::CtOptions::coarser(4)).value();
  store::Case row;
  row.label = "phantom";
  row.grid = ct.grid;
  row.ct = store.blobs().put(jobs::encodeCt(ct)).value();
  const std::string id = store.addCase(row).value().id;
  const auto label = store.blobs().put(jobs::encodeLabel(phantom::truthLabel(truth, ct.grid))).value();
  EXPECT_TRUE(store.setLabel(id, label, "segmented").has_value());
  return id;
}

}  // namespace spinaltap::test
