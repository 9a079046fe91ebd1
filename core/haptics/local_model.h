// core/haptics/local_model.h - what a client needs to feel the bone between two answers of the server.
//
// After: G. Picinbono and J.-C. Lombardo, "Extrapolation: a solution for force feedback?", Int. Workshop on Virtual
// Reality and Prototyping, 1999. They extrapolate forces; here the server sends what its bit would meet, and the client
// moves a bit of its own through that, with the same law and coupling (proxy.h), at its own rate. So what is felt at
// the client answers the hand at once, however late the server is, and is passive by itself.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/haptics/proxy.h"

namespace spinaltap::haptics {

inline constexpr std::size_t kDepthsAhead = 5, kLocalSides = 8;
/// How far ahead along the axis the tip's frontal area is told, mm.
inline constexpr std::array<double, kDepthsAhead> kAhead_mm{0, 0.25, 0.5, 1.0, 2.0};

/// As seen from where the server's bit stood after a pose.
struct LocalModel {
  Rod bit;
  std::array<float, kDepthsAhead> frontal_mm2{};  ///< Meeting::frontal_mm2, of a bit so far ahead
  float rubbing_mm2 = 0;
  std::array<float, kLocalSides> side_mm2{};    ///< met in the direction of i eighths of a turn, tool frame
  std::array<float, kLocalSides> side_lever{};  ///< SideContact::lever of it
};

/// Gathers what is met into a local model. @param ahead of the bit as it stands, and so far on as kAhead_mm says.
[[nodiscard]] LocalModel localModel(const Rod& bit, const Meeting& meeting,
                                    const std::array<double, kDepthsAhead>& frontal_mm2);

/// What a bit meets that stands `ahead_mm` beyond the model's, in between by straight lines; one that does not turn
/// meets what the nearer of two depths tells.
[[nodiscard]] Meeting meetingOf(const LocalModel& model, double ahead_mm, bool spinning);

/// The client's own bit.
class LocalBit {
 public:
  /// How long a difference between the server's bit and ours takes to shrink to a third, once it is known.
  static constexpr double kReckoning_s = 0.020;
  static constexpr std::size_t kMostRemembered = 1024;

  LocalBit(const Coupling& coupling, const Drive& drive) : proxy_(coupling, drive) {}

  /// The first pose, where nothing is known yet.
  void place(const Rod& hand);
  /// Moves on by one period of the client. @param seq the pose's number, to be answered by the server some time.
  /// @param reserve_mJ what moving our bit towards the server's may add to the spring: what the hand has put in and did
  ///        not get back (PassivityGuard), what the spring holds already left out. So reckoning makes no energy; what
  ///        it may not do now it does later.
  /// @pre as Proxy::step; numbers go up by one, modulo 2^32.
  Reaction step(std::uint32_t seq, const Rod& hand, double seconds, bool spinning, double reserve_mJ);
  /// The server's answer to pose `seq`: ignored if it is older than the last one, or than what is remembered.
  void learn(std::uint32_t seq, const LocalModel& model);

  [[nodiscard]] const Rod& rod() const { return proxy_.rod(); }

 private:
  void reckon(double seconds, double reserve_mJ);
  struct Past {
    std::uint32_t seq = 0;
    bool known = false;
    Vec3 own_mm;  ///< where our bit was, all that was ever made good left out
  };
  Proxy proxy_;
  Rod hand_;
  LocalModel model_;
  bool learnt_ = false;
  std::uint32_t learnt_seq_ = 0;
  Vec3 missing_mm_;    ///< from our bit to the server's, as far as it is known and not yet made good
  Vec3 made_good_mm_;  ///< all that was
  std::array<Past, kMostRemembered> past_{};
};

}  // namespace spinaltap::haptics
