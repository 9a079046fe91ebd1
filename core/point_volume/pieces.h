// core/point_volume/pieces.h - a point volume built some discs at a time, ahead of the bit, so that a session opens
// with its first millimetres and does not wait for the far end.
//
//   PointVolume volume = *emptyVolume(lattice);
//   place(*buildDiscs(lattice, 0, 20, ...), 0, volume);   // the session may begin
//   then, on another thread, buildDiscs(lattice, 20, 40, ...), and so on; the live thread places each between cycles.
//
// Discs that are not placed yet have no alive points: nothing would be cut or felt there. So whoever drills must hold
// the bit before the first disc that is missing, and place a piece before the bit can reach it.
#pragma once
#include "core/point_volume/point_volume.h"

namespace spinaltap::point_volume {

/// Discs begin .. end-1 as a lattice of their own, at the same places.
/// @pre 0 <= begin < end <= lattice.discs.
[[nodiscard]] Lattice discsOf(const Lattice& lattice, int begin, int end);

/// No point alive, no density: a volume before its pieces.
/// @error as checkLattice.
[[nodiscard]] Result<PointVolume> emptyVolume(const Lattice& lattice);

/// Discs begin .. end-1 of what buildVolume(lattice, ..) builds, bit for bit, with discsOf(lattice, begin, end).
/// Pieces may be built in any order and by several threads.
/// @error as buildVolume; InvalidArgument (discs that the lattice has not).
[[nodiscard]] Result<PointVolume> buildDiscs(const Lattice& lattice, int begin, int end, const Frame& path_frame,
                                             const Field& field, const HuSampler& hu, unsigned threads = 0);

/// Puts a piece in its place; what was there is replaced, and no other disc's points are touched (though words of
/// alive bits are shared with the discs beside it: one thread at a time). Allocates nothing.
/// @pre piece.lattice == discsOf(volume.lattice, begin, begin + piece.lattice.discs).
/// @cost some microseconds a millimetre at 0.1 mm.
void place(const PointVolume& piece, int begin, PointVolume& volume);

}  // namespace spinaltap::point_volume
