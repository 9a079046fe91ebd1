// core/wire/bytes.h - little-endian fields, one by one; a struct's bytes never leave the process.
#pragma once
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/vec3.h"

namespace spinaltap::wire {

/// Copies numbers between memory and little-endian bytes, all at once where the machine's own order is the wire's.
template <class T>
void copyLittleEndian(std::byte* to, const std::byte* from, std::size_t count) {
  if constexpr (std::endian::native == std::endian::little) {
    if (count > 0) std::memcpy(to, from, count * sizeof(T));
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t b = 0; b < sizeof(T); ++b) to[i * sizeof(T) + b] = from[(i + 1) * sizeof(T) - 1 - b];
    }
  }
}

class ByteWriter {
 public:
  void u8(std::uint8_t v) { bytes_.push_back(static_cast<std::byte>(v)); }
  void u16(std::uint16_t v) { integer(v); }
  void u32(std::uint32_t v) { integer(v); }
  void u64(std::uint64_t v) { integer(v); }
  void i32(std::int32_t v) { integer(static_cast<std::uint32_t>(v)); }
  void f32(float v) {
    std::uint32_t b = 0;
    std::memcpy(&b, &v, sizeof b);
    u32(b);
  }
  void f64(double v) {
    std::uint64_t b = 0;
    std::memcpy(&b, &v, sizeof b);
    u64(b);
  }
  void vec3(const Vec3& v) { f64(v.x), f64(v.y), f64(v.z); }
  /// Length as u32, then the bytes.
  void text(std::string_view v) {
    u32(static_cast<std::uint32_t>(v.size()));
    for (const char c : v) u8(static_cast<std::uint8_t>(c));
  }
  /// Numbers in order, without a count.
  template <class T>
  void array(std::span<const T> v) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + v.size_bytes());
    copyLittleEndian<T>(bytes_.data() + at, reinterpret_cast<const std::byte*>(v.data()), v.size());
  }
  void reserve(std::size_t size) { bytes_.reserve(size); }
  void raw(std::span<const std::byte> v) { bytes_.insert(bytes_.end(), v.begin(), v.end()); }

  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }
  void clear() { bytes_.clear(); }

 private:
  template <class T>
  void integer(T v) {
    for (unsigned shift = 0; shift < 8 * sizeof(T); shift += 8) u8(static_cast<std::uint8_t>(v >> shift));
  }
  std::vector<std::byte> bytes_;
};

/// As ByteWriter, into N bytes that are there: for messages of one size that are written at haptic rates.
/// @pre what is written fits.
template <std::size_t N>
class FixedWriter {
 public:
  void u8(std::uint8_t v) { put(v); }
  void u32(std::uint32_t v) { put(v); }
  void u64(std::uint64_t v) { put(v); }
  void f32(float v) { put(v); }
  void f64(double v) { put(v); }
  void vec3(const Vec3& v) { put(v.x), put(v.y), put(v.z); }
  [[nodiscard]] std::span<const std::byte> bytes() const { return std::span(bytes_).first(size_); }

 private:
  template <class T>
  void put(T v) {
    assert(size_ + sizeof v <= N);
    copyLittleEndian<T>(bytes_.data() + size_, reinterpret_cast<const std::byte*>(&v), 1);
    size_ += sizeof v;
  }
  std::array<std::byte, N> bytes_;
  std::size_t size_ = 0;
};

/// Reads past the end give zeros and set failed(); check it once, at the end or before a length is trusted.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint8_t u8() {
    if (at_ >= bytes_.size()) {
      failed_ = true;
      return 0;
    }
    return static_cast<std::uint8_t>(bytes_[at_++]);
  }
  std::uint16_t u16() { return integer<std::uint16_t>(); }
  std::uint32_t u32() { return integer<std::uint32_t>(); }
  std::uint64_t u64() { return integer<std::uint64_t>(); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  float f32() {
    const std::uint32_t b = u32();
    float v = 0;
    std::memcpy(&v, &b, sizeof v);
    return v;
  }
  double f64() {
    const std::uint64_t b = u64();
    double v = 0;
    std::memcpy(&v, &b, sizeof v);
    return v;
  }
  Vec3 vec3() {
    const double x = f64(), y = f64(), z = f64();
    return {x, y, z};
  }
  /// Fails when the length exceeds `limit` or what is left.
  std::string text(std::size_t limit = 4096) {
    const std::span<const std::byte> v = raw(u32(), limit);
    return {reinterpret_cast<const char*>(v.data()), v.size()};
  }
  std::span<const std::byte> raw(std::size_t size, std::size_t limit = SIZE_MAX) {
    if (failed_ || size > limit || size > left()) {
      failed_ = true;
      return {};
    }
    at_ += size;
    return bytes_.subspan(at_ - size, size);
  }

  /// `count` numbers; fails, without allocating, when that many are not left.
  template <class T>
  std::vector<T> array(std::uint64_t count) {
    if (failed_ || count > left() / sizeof(T)) {
      failed_ = true;
      return {};
    }
    const std::span<const std::byte> from = raw(static_cast<std::size_t>(count) * sizeof(T));
    std::vector<T> v(static_cast<std::size_t>(count));
    copyLittleEndian<T>(reinterpret_cast<std::byte*>(v.data()), from.data(), v.size());
    return v;
  }

  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  [[nodiscard]] std::size_t offset() const { return at_; }

 private:
  template <class T>
  T integer() {
    T v = 0;
    for (unsigned shift = 0; shift < 8 * sizeof(T); shift += 8) v = static_cast<T>(v | (static_cast<T>(u8()) << shift));
    return v;
  }
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

}  // namespace spinaltap::wire
