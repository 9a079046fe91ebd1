// core/mesh/node_map.h - numbers at lattice nodes, kept only where there are any (internal).
#pragma once
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/mesh/lattice.h"

namespace spinaltap::mesh {

/// Node -> number, in bricks of 1024 nodes (4 KB) that are made when first written to. Nothing iterates over it, so the
/// order of the directory never shows.
class NodeMap {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  /// A place to look from: remembers the last brick, so that neighbours are found without a search. One a thread.
  class Reader {
   public:
    explicit Reader(const NodeMap& map) : map_(map) {}
    [[nodiscard]] std::uint32_t at(Key key) {
      if (key >> kLocalBits != brick_) {
        brick_ = key >> kLocalBits;
        const auto found = map_.directory_.find(brick_);
        first_ = found == map_.directory_.end() ? kNowhere : found->second;
      }
      return first_ == kNowhere ? kNone : map_.numbers_[first_ + (key & kLocalMask)];
    }

   private:
    const NodeMap& map_;
    Key brick_ = ~Key{0};
    std::size_t first_ = kNowhere;
  };

  [[nodiscard]] std::uint32_t& at(Key key) {
    if (key >> kLocalBits != brick_) {
      brick_ = key >> kLocalBits;
      const auto [found, made] = directory_.try_emplace(brick_, numbers_.size());
      if (made) numbers_.resize(numbers_.size() + kLocalMask + 1, kNone);
      first_ = found->second;
    }
    return numbers_[first_ + (key & kLocalMask)];
  }

 private:
  static constexpr Key kLocalMask = (Key{1} << kLocalBits) - 1;
  static constexpr std::size_t kNowhere = ~std::size_t{0};

  std::unordered_map<Key, std::size_t> directory_;  ///< brick -> its first number
  std::vector<std::uint32_t> numbers_;
  Key brick_ = ~Key{0};
  std::size_t first_ = 0;
};

}  // namespace spinaltap::mesh
