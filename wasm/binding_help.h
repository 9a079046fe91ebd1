// wasm/binding_help.h - bytes, numbers and errors between JavaScript and the core.
#pragma once
#include <emscripten/val.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace spinaltap::wasm {

/// Keeps the message for takeError(); errors.js throws it once the binding has returned.
void keepError(Error error);

/// What was made, or null with the error kept.
template <class T>
T* orNull(Result<std::unique_ptr<T>> made) {
  if (made) return made->release();
  keepError(std::move(made.error()));
  return nullptr;
}

/// @error InvalidArgument, when it is not a Uint8Array.
[[nodiscard]] Result<std::vector<std::byte>> bytesOf(const emscripten::val& array, const char* what);

/// A copy, of the type that JavaScript calls `type`.
template <class T>
[[nodiscard]] emscripten::val arrayOf(const char* type, const std::vector<T>& values) {
  return emscripten::val::global(type).new_(emscripten::typed_memory_view(values.size(), values.data()));
}
[[nodiscard]] emscripten::val bytesToArray(const std::vector<std::byte>& bytes);

/// 16 hex digits.
[[nodiscard]] std::string hexOf(std::uint64_t hash);

/// JavaScript has doubles: NaN and negative numbers become 0, large ones saturate at 2^53.
[[nodiscard]] std::uint64_t wholeOf(double number);

}  // namespace spinaltap::wasm
