/// What is kept by sectors of cells: in memory, or with pages on disk in part.
#pragma once

#include <cstddef>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kernels/core/grid.h"
#include "page/paged_values.h"

namespace dtsdf {

/// Sectors by packed key. A copy stays as it is, for any thread.
template <class T>
using Sectors = std::unordered_map<PackedKey, Paged<T>>;

/// Sectors that are changed one after the other; those that are empty go. For one thread, but that
/// any number may read while none are open.
template <class T>
class SectorTable {
 public:
  /// @param pages Null: all stay in memory.
  explicit SectorTable(SharedPagedValues pages) : pages_(std::move(pages)) {}

  /// A sector as it is. @return null: there is none, or it cannot be read.
  std::shared_ptr<const T> find(PackedKey key) const {
    const auto open = open_.find(key);
    if (open != open_.end() && open->second != nullptr) return open->second;
    const auto place = sectors_.find(key);
    return place == sectors_.end() ? nullptr : place->second.get();
  }

  /// A sector that is going to be changed, made if there is none; one that cannot be read is lost.
  /// It stays where it is until close().
  T& open(PackedKey key) {
    std::shared_ptr<T>& sector = open_[key];
    if (sector != nullptr) return *sector;
    const auto place = sectors_.find(key);
    if (place != sectors_.end()) sector = place->second.take();
    if (sector == nullptr) {
      sector = std::make_shared<T>(place == sectors_.end() ? T() : T::lost());
    }
    return *sector;
  }

  /// Changes are made, for now.
  void close() {
    for (auto next = open_.begin(); next != open_.end(); next = open_.erase(next)) {
      const auto& [key, sector] = *next;
      if (sector == nullptr) continue;  // memory ran out while it was opened
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

  /// All of them. @pre None is open.
  const Sectors<T>& all() const { return sectors_; }

  /// Memory that it takes, but for what its pages count.
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
