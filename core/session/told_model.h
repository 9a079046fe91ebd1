// core/session/told_model.h - what a client is told of the bone, looked up only as often as it changes.
#pragma once
#include <optional>

#include "core/session/session.h"

namespace spinaltap::session {

/// The bone ahead costs more to look at than a cycle costs to drill, and what is met changes with the lattice's cells:
/// it is looked up anew once a point of the tip has moved by kAnew spacings, and told from where the bit then stands.
/// The far end of a bit that turns moves farther, but told are only its sides, as a whole.
class ToldModel {
 public:
  static constexpr double kAnew = 0.1;

  /// @param bit where the session's bit stands. @cost mostly nothing; else Session::localModel().
  [[nodiscard]] haptics::LocalModel of(const Session& session, const drill::BitPose& bit) {
    if (!told_ || moved_mm(session, bit) > kAnew * session.volume().lattice.spacing_mm) {
      told_ = session.localModel();
      looked_from_ = bit;
    }
    told_->bit = {bit.tip_mm, bit.axis};
    return *told_;
  }

 private:
  [[nodiscard]] double moved_mm(const Session& session, const drill::BitPose& bit) const {
    const plan::Bit& of = session.config().bit;
    const double tip_mm = of.cone_length_mm + of.diameter_mm;
    return norm(bit.tip_mm - looked_from_.tip_mm) + tip_mm * norm(bit.axis - looked_from_.axis);
  }

  std::optional<haptics::LocalModel> told_;
  drill::BitPose looked_from_;
};

}  // namespace spinaltap::session
