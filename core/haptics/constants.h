// core/haptics/constants.h - every number of the drilling physics: value, unit, source, and what changing it does.
//
// The reference is human femoral cortex under a 3.2 mm surgical bit at 2 mm/s: 198, 181 and 176 N at 1000, 1250 and
// 1500 rpm (T. MacAvelia et al., J. Biomech. Eng. 134, 124503, 2012). A straight line through these over the feed per
// revolution (0.12, 0.096, 0.08 mm) leaves at most 2.5 N: 129.5 N + 562 N/mm * feed.
#pragma once

namespace spinaltap::haptics {

/// Apparent density of that cortex. (D. R. Carter and W. C. Hayes, J. Bone Joint Surg. 59-A, 1977: cortical bone
/// 1.8-2.0 g/cm3.) Higher: every force falls by the square.
inline constexpr double kCortex_mg_cm3 = 1850;

/// Hardness is (density / kCortex_mg_cm3)^2: the strength of bone goes with the square of its apparent density over
/// cortical and cancellous bone alike (Carter and Hayes 1977). So forces of all kinds need one sum over the bone met.

/// What the chisel edge needs before anything advances, per mm2 of the bit's frontal area at hardness 1:
/// 129.5 N / 8.04 mm2. Higher: bone resists more, whatever the feed; a drill pushed with less stands.
inline constexpr double kChisel_N_mm2 = 16.1;

/// What the lips need: thrust per mm2 at hardness 1 and a feed per revolution as large as the diameter:
/// 562 N/mm * 3.2 mm / 8.04 mm2. (Lips are as long as the bit is wide, so their thrust goes with diameter times feed.)
/// Higher: bone feels more viscous, slower advance for the same thrust.
inline constexpr double kLips_N_mm2 = 224;

/// Specific cutting energy at hardness 1: torque = energy * area * feed / (2 pi), 18 N mm in the reference at
/// 1000 rpm; 10-23 N mm were measured in bovine, 10-14.5 in other cortex (Alam; Hillery; quoted by B. Orelaja et al.,
/// J. Healthcare Eng. 2020, 8817422, table 6). Higher: more torque, nothing else.
inline constexpr double kCutting_J_mm3 = 0.12;

/// Sides against tip, per mm2: a twist drill's margins are ground not to cut. No published figure for side cutting of
/// bone was found; 40 lets 20 N of side force widen 5 mm of hole in cancellous bone by about 0.5 mm/s, a tenth of what
/// the tip does. Higher: the hole guides the bit more strictly.
inline constexpr double kSideLips = 40;
/// Threshold of the sides, against the tip's. 1: as hard to start as the tip, over a much larger area.
inline constexpr double kSideChisel = 1;

/// Rubbing of the shaft in its hole, per mm2 of shaft in contact at hardness 1, in either direction. An assumption:
/// 0.2 N for 20 mm of hole in cancellous bone, a third of a newton for a vertebra's cortex. Higher: more drag on
/// withdrawal.
inline constexpr double kRubbing_N_mm2 = 0.05;

/// A surgical drill's speed where none is given.
inline constexpr double kSpeed_rpm = 1000;

/// Coupling between hand and bit where no device says otherwise: under 3.3 N the bit is 0.7 mm behind the hand.
inline constexpr double kStiffness_N_mm = 5;

/// Of the stiffest coupling that theory allows a device, this part is used at most. Simulated hands come to rest at a
/// wall up to 0.77 of it at 300 Hz and more at higher rates (spinaltap tradeoff --haptics); more makes energy.
inline constexpr double kCouplingMargin = 0.75;

/// Where the second lateral spring of the coupling holds the drill: the middle of the grip, so far behind the tip.
inline constexpr double kGrip_mm = 150;

/// Of the free force that devices are scaled to: what vertebral drilling reaches with margin (porcine vertebrae
/// 0.6-29.6 N: Powers, quoted by Orelaja 2020, table 6).
inline constexpr double kFullForce_N = 40;

/// Two inputs farther apart than that are a pause: the hand's pull in between is not known.
inline constexpr double kPause_s = 0.1;

}  // namespace spinaltap::haptics
