/// A backend that only writes down what it is asked, and answers as a test wants it to.
#pragma once

#include <new>
#include <string>
#include <utility>
#include <vector>

#include "backend/map_backend.h"

namespace dtsdf {

/// What a recorder answers, and what it was asked; outlives it.
struct Script {
  std::vector<BlockRequest> requests;  ///< Of each depth image.
  std::vector<ColourRequest> colour_requests;
  std::vector<EmptyBlock> empty;                   ///< Taken once.
  bool lacks_blocks = false, lacks_frame = false;  ///< Memory for new blocks; for a frame.
  bool lacks_host = false;                         ///< The host's, once blocks are entered.
  bool has_mirror = false;

  std::vector<std::string> calls;
  std::vector<int32_t> entered, zeroed, followed, in_view;
  uint64_t frame_number = 0;
  int made = 0;

  std::vector<std::string> takeCalls() {
    std::vector<std::string> taken;
    taken.swap(calls);
    return taken;
  }
};

class Recorder : public MapBackend {
 public:
  explicit Recorder(Script& script) : script_(script) { ++script.made; }

  BackendTraits traits() const override {
    BackendTraits traits;
    traits.name = "recorder";
    traits.indexes_blocks_itself = script_.has_mirror;
    return traits;
  }
  void enter() override {}
  void profileTo(Profile*) override {}
  void addMemory(std::vector<MemoryPart>&) const override {}
  void takePoints(const DepthFrame&, const FrameView&) override { note("take points"); }
  AlignmentSums sumsAt(const FrameView&, float) override { return {}; }
  void sense(const DepthFrame&, const FrameView&) override { note("sense"); }
  void makeSurfels() override { note("make surfels"); }
  void findBlocks() override { note("find blocks"); }
  TouchedBlocks lookUpBlocks() override {
    note("look up blocks");
    const size_t count = script_.requests.size();
    return {count, count, script_.requests, count};
  }
  void seeFree(std::vector<Vec3i>) override { note("see free"); }
  void reserveFrame(const FusionPass&) override { need(!script_.lacks_frame); }
  void castFoldAndClear(const FusionPass& pass) override {
    note("cast, fold, clear");
    if (script_.lacks_host) throw std::bad_alloc();
    script_.frame_number = pass.number;
    script_.in_view = pass.in_view;
    free_ = {{{0, 0, 0}, {{1}}}};
  }
  FrameOutcome takeOutcome() override {
    return {std::exchange(script_.empty, {}), std::exchange(free_, {})};
  }
  void takeColours(const ColourFrame&) override { note("take colours"); }
  SeenColours look(const PaintView&) override {
    note("look");
    return {!script_.colour_requests.empty(), {}, script_.colour_requests};
  }
  void paint(const Exposure&) override { note("paint"); }
  void render(const ViewRequest&, RenderedView&) override { note("render"); }
  void markAll(const MeshMarks& marks) override { note(marks.dirty ? "mark all" : "keep colours"); }
  void beginMesh(int32_t) override { note("begin mesh"); }
  void waitForMeshes() override {}
  MeshUpdate finishMesh() override {
    note("finish mesh");
    return {};
  }
  void reserve(const MemoryDemand&) override { need(!script_.lacks_blocks); }
  void follow(const TableChanges& changes) override {
    if (changes.new_bricks != nullptr) note("admit colours");
    if (changes.new_arrays != nullptr) {
      note("admit");
      script_.entered = changes.slots;
      script_.zeroed = *changes.new_arrays;
    } else if (!changes.slots.empty()) {
      script_.followed = changes.slots;
    }
  }
  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                        const RegionView&) override {
    note("empty region");
    return std::vector<EmptiedBlock>(slots.size(), EmptiedBlock{1, 63});
  }
  void copyOut(const ContentsOrder&, MapContents&, MeshStates*) override { note("copy out"); }
  void copyIn(const ContentsOrder&, const MapContents&, const MeshStates*) override {
    note("copy in");
  }
  std::vector<PackedKey> neededKeys(const std::vector<PackedKey>&, uint64_t) override { return {}; }
  std::vector<PackedKey> alignedKeys(const FrameView&, float) override { return {}; }
  std::vector<MarkedSlot> marked(bool) override { return {}; }
  void setMarks(const std::vector<MarkedSlot>&) override {}

 private:
  void note(const char* call) { script_.calls.push_back(call); }
  static void need(bool memory) {
    if (!memory) throw BackendError(true, "no memory");
  }

  Script& script_;
  std::vector<FreeCube> free_;
};

}  // namespace dtsdf
