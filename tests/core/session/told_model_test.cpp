#include "core/session/told_model.h"

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace spinaltap::session {
namespace {

constexpr point_volume::Lattice kLattice{0.2, 20, 80, -10};

TEST(ToldModel, IsAsOfABitWhoseTipWasATenthOfASpacingAwayAtMost) {
  Random random(63);
  point_volume::PointVolume volume = *point_volume::solidVolume(kLattice, 1);
  for (auto& density : volume.density_mg_cm3) density = static_cast<std::uint16_t>(100 + random.below(1500));
  Config config{plan::Bit{3, 5, 20}};
  Session session = Session::create(volume, config).value();
  ToldModel told;
  std::vector<std::pair<drill::BitPose, haptics::LocalModel>> truths;
  Input input;
  int anew = 0, as_before = 0;
  haptics::LocalModel before;
  for (int i = 0; i < 400; ++i) {
    // Slow, then fast, then turning where it stands.
    input.t_us += 1000;
    if (i < 300) input.tip_mm.z += i < 200 ? 0.005 : 0.05;
    if (i >= 300) input.axis = {0.002 * (i - 300), 0, 1};
    const Output output = session.step(input);
    const haptics::LocalModel model = told.of(session, output.bit);
    EXPECT_EQ(model.bit.tip_mm, output.bit.tip_mm);
    EXPECT_EQ(model.bit.axis, output.bit.axis);
    truths.emplace_back(output.bit, session.localModel());
    // It is the truth of one of the poses so near.
    bool found = false;
    for (auto truth = truths.rbegin(); truth != truths.rend() && !found; ++truth) {
      const double far = norm(truth->first.tip_mm - output.bit.tip_mm) + 8 * norm(truth->first.axis - output.bit.axis);
      found = far <= 0.1 * 0.2 && truth->second.frontal_mm2 == model.frontal_mm2 &&
              truth->second.side_mm2 == model.side_mm2;
    }
    ASSERT_TRUE(found) << i;
    const bool same = i > 0 && before.frontal_mm2 == model.frontal_mm2 && before.side_mm2 == model.side_mm2;
    same ? ++as_before : ++anew;
    before = model;
  }
  EXPECT_GT(as_before, 100) << "looked up although hardly anything moved";
  EXPECT_GT(anew, 100);
}

}  // namespace
}  // namespace spinaltap::session
