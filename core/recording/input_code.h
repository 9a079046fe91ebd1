// core/recording/input_code.h - the inputs of a chunk in few bits, and back to the last bit. Layout: FORMAT.md, "Coded
// inputs". For writer.cpp and reader.cpp alone.
//
// Each of the eight numbers of an input is foretold from those before it, and only what the prophecy missed by is kept.
// A hand moves smoothly, so its next position follows from the differences of its last ones (a polynomial through
// them); an axis is a unit vector, so its last component follows from the other two. Both are computed in doubles with
// + - * / sqrt alone, so a reader on any machine foretells the same bits. What is not smooth (noise, jumps, refused
// inputs, NaNs) costs more bits, never information.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/session/session.h"
#include "core/wire/bytes.h"

namespace spinaltap::recording {

/// Appends `inputs` to `out`. `before` are the inputs of the recording so far, or at least its last kCodeMemory.
/// @cost half a microsecond an input: the ways to foretell are tried on the last ones, and the cheapest is taken.
void encodeInputs(std::span<const session::Input> before, std::span<const session::Input> inputs,
                  wire::ByteWriter& out);

/// Appends `count` inputs to `inputs`, which holds those before them; reads all of `code`.
/// False when the code is too short, too long, or none that the writer makes.
[[nodiscard]] bool decodeInputs(std::span<const std::byte> code, std::size_t count,
                                std::vector<session::Input>& inputs);

/// How many inputs before the first the code looks back at.
inline constexpr std::size_t kCodeMemory = 12;

}  // namespace spinaltap::recording
