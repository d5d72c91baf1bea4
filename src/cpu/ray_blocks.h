/// The blocks of the map that the rays of a view pass through, and the units that they meet there:
/// each is made once for all threads, by the first one that asks for it.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "cpu/vertex_colours.h"
#include "cpu/voxel_bits.h"
#include "kernels/core/camera.h"
#include "kernels/meshing/mesh_rules.h"
#include "kernels/render/pixel.h"

namespace dtsdf {

constexpr int32_t kNotInView = -1;

/// A view's camera, and what its units are made of.
struct RayScene {
  MeshedMap map;
  FrameView frame;
  MeshRules rules;
  int32_t least_evidence;
  bool directional;
  bool painted;                                ///< Colours are asked for.
  const std::vector<VoxelBits>& bits;          ///< Of the blocks in view,
  const std::vector<int32_t>& number_of_slot;  ///< whose places are here, or kNotInView.
};

/// What is kept of a value beside it, so that most who ask need not look at the value itself.
inline uint8_t markOf(const RayUnit& unit) { return static_cast<uint8_t>(unit.state); }
inline uint8_t markOf(const UnitColours&) { return 0; }

/// A value for each of a block's units, made by whoever asks first.
template <class T>
class UnitPage {
 public:
  void clear() {
    for (std::atomic<uint8_t>& state : states_) state.store(kNone, std::memory_order_relaxed);
  }

  /// Whether a unit's value is made, and has such a mark.
  bool hasMark(int unit, uint8_t mark) const {
    return states_[unit].load(std::memory_order_acquire) == kMade + mark;
  }

  /// make() gives the value. While another thread makes it, it goes to `own`.
  template <class Make>
  const T& at(int unit, T& own, const Make& make) {
    std::atomic<uint8_t>& state = states_[unit];
    uint8_t found = state.load(std::memory_order_acquire);
    if (found >= kMade) return values_[unit];
    if (found == kNone && state.compare_exchange_strong(found, kBeingMade)) {
      values_[unit] = make();
      state.store(static_cast<uint8_t>(kMade + markOf(values_[unit])), std::memory_order_release);
      return values_[unit];
    }
    own = make();
    return own;
  }

 private:
  static constexpr uint8_t kNone = 0, kBeingMade = 1, kMade = 2;
  std::atomic<uint8_t> states_[kVoxelsPerBlock];
  T values_[kVoxelsPerBlock];
};

/// Pages that are kept from view to view.
template <class Page>
class PagePool {
 public:
  void begin() { used_ = 0; }

  /// A page with no values.
  Page* take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (used_ == pages_.size()) pages_.push_back(std::make_unique<Page>());
    Page* page = pages_[used_++].get();
    page->clear();
    return page;
  }

  size_t bytes() const { return pages_.size() * sizeof(Page); }

 private:
  std::mutex mutex_;
  size_t used_ = 0;
  std::vector<std::unique_ptr<Page>> pages_;
};

/// A block, and the seven that its units reach into, by the corner of a unit that lies there.
struct RayBlock {
  std::atomic<bool> is_ready{false};
  const BlockEntry* entry[kCubeCorners];               ///< Null: there is none.
  const Voxel* voxels[kCubeCorners][kDirectionCount];  ///< Zeroes where there are none.
  UnitBits units;
  std::atomic<UnitPage<RayUnit>*> made{nullptr};
  std::atomic<UnitPage<UnitColours>*> coloured{nullptr};
};

class RayBlocks {
 public:
  /// Forgets what is known of another view. `scene` has to last until the next call.
  void begin(const RayScene& scene, size_t blocks_in_view);

  const RayScene& scene() const { return *scene_; }

  /// Null where the map has none. Every block that a ray may enter is in view.
  RayBlock* find(const BlockKey& key);

  UnitPage<RayUnit>& madeOf(RayBlock& block) { return pageOf(block.made, made_); }
  UnitPage<UnitColours>& colouredOf(RayBlock& block) { return pageOf(block.coloured, coloured_); }

  size_t bytes() const;

 private:
  static constexpr size_t kLocks = 64;

  int32_t slotOf(const BlockKey& key) const;
  void fill(const BlockKey& key, int32_t slot, RayBlock& block) const;
  void fillCorner(int32_t slot, int c, RayBlock& block) const;
  template <class Page>
  static Page& pageOf(std::atomic<Page*>& place, PagePool<Page>& pool) {
    Page* page = place.load(std::memory_order_acquire);
    if (page != nullptr) return *page;
    Page* fresh = pool.take();
    // Another thread may have been faster: the pool has this one back with the next view.
    return place.compare_exchange_strong(page, fresh) ? *fresh : *page;
  }

  const RayScene* scene_ = nullptr;
  std::unique_ptr<RayBlock[]> blocks_;  ///< By their places among those in view.
  size_t room_ = 0;
  std::array<std::mutex, kLocks> locks_;  ///< Of blocks that are filled.
  PagePool<UnitPage<RayUnit>> made_;
  PagePool<UnitPage<UnitColours>> coloured_;
};

}  // namespace dtsdf
