/// One value per sector of 32 x 32 x 32 cells, in memory or, with pages, partly on disk.
#pragma once

#include <cstddef>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kernels/core/grid.h"
#include "page/paged_values.h"

namespace dtsdf {

/// Sectors by packed key. Any thread may read a copy, because changes to the original do not affect
/// it.
template <class T>
using Sectors = std::unordered_map<PackedKey, Paged<T>>;

/// A table of sectors. Open a sector to change it; sectors that are empty when closed are removed.
/// Not thread-safe, but any number of threads may read it while no sector is open.
template <class T>
class SectorTable {
 public:
  /// @param pages Null to keep everything in memory.
  explicit SectorTable(SharedPagedValues pages) : pages_(std::move(pages)) {}

  /// A sector in its current state. @return null if there is no such sector, or it cannot be read.
  std::shared_ptr<const T> find(PackedKey key) const {
    const auto open = open_.find(key);
    if (open != open_.end()) return open->second;
    const auto place = sectors_.find(key);
    return place == sectors_.end() ? nullptr : place->second.get();
  }

  /// Opens a sector to change it, and adds it if it is missing. If it cannot be read, T::lost()
  /// replaces it. The reference is valid until close().
  T& open(PackedKey key) {
    if (const auto open = open_.find(key); open != open_.end()) return *open->second;
    const auto place = sectors_.find(key);
    auto sector = place == sectors_.end() ? std::make_shared<T>() : place->second.take();
    if (sector == nullptr) sector = std::make_shared<T>(T::lost());
    return *open_.emplace(key, std::move(sector)).first->second;
  }

  /// Ends a series of changes: closes all open sectors.
  void close() {
    for (auto next = open_.begin(); next != open_.end(); next = open_.erase(next)) {
      const auto& [key, sector] = *next;
      if (sector->isEmpty()) {
        sectors_.erase(key);
      } else {
        sectors_[key] = Paged<T>(sector, pages_);
      }
    }
  }

  void clear() {
    open_.clear();
    sectors_.clear();
  }

  std::vector<PackedKey> keys() const {
    std::vector<PackedKey> keys;
    keys.reserve(sectors_.size());
    for (const auto& [key, sector] : sectors_) keys.push_back(key);
    return keys;
  }

  /// All sectors. @pre No sector is open.
  const Sectors<T>& all() const { return sectors_; }

  /// Memory use in bytes, excluding the values that `pages` counts itself.
  size_t bytes() const {
    constexpr size_t kNode = sizeof(PackedKey) + sizeof(Paged<T>) + 3 * sizeof(void*);
    size_t bytes = sectors_.size() * kNode;
    if (pages_ != nullptr) return bytes;
    for (const auto& [key, sector] : sectors_) {
      if (const std::shared_ptr<const T> value = sector.get()) bytes += value->bytes();
    }
    return bytes;
  }

 private:
  SharedPagedValues pages_;
  Sectors<T> sectors_;
  std::unordered_map<PackedKey, std::shared_ptr<T>> open_;
};

}  // namespace dtsdf
