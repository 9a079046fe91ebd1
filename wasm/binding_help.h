// wasm/binding_help.h - bytes, numbers and errors between JavaScript and the core.
#pragma once
#include <emscripten/stack.h>
#include <emscripten/val.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace spinaltap::wasm {

/// Throws a JavaScript Error of one line. The wasm frames above are left without unwinding, so the caller holds nothing
/// when it calls; `stack` (emscripten_stack_get_current() of the outermost frame) is put back.
[[noreturn]] void throwError(const std::string& message, std::uintptr_t stack);

/// work() returns a Result<T>; T must be movable and default constructible. Everything that work held is gone before an
/// error is thrown.
template <class T, class Work>
T orThrow(Work&& work) {
  const std::uintptr_t stack = emscripten_stack_get_current();
  static std::string message;  // survives the throw, so that it is not lost to it
  message.clear();
  {
    Result<T> result = work();
    if (result) return std::move(*result);
    message = std::move(result.error().message);
  }
  throwError(message, stack);
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
