/// A backend that fails and answers as a test wants it to.
#pragma once

#include <new>
#include <vector>

#include "backend/map_backend.h"

namespace dtsdf {

/// What a recorder answers, and which blocks it was given; outlives it.
struct Script {
  std::vector<BlockRequest> requests;              ///< Of each depth image.
  bool lacks_blocks = false, lacks_frame = false;  ///< Memory for new blocks; for a frame.
  bool lacks_host = false;                         ///< The host's, once blocks are entered.
  bool has_mirror = false;

  std::vector<int32_t> entered;
};

class Recorder : public MapBackend {
 public:
  explicit Recorder(Script& script) : script_(script) {}

  BackendTraits traits() const override {
    BackendTraits traits;
    traits.name = "recorder";
    traits.indexes_blocks_itself = script_.has_mirror;
    return traits;
  }
  void enter() override {}
  void profileTo(Profile*) override {}
  void addMemory(std::vector<MemoryPart>&) const override {}
  void takePoints(const DepthFrame&, const FrameView&) override {}
  AlignmentSums sumsAt(const FrameView&, float) override { return {}; }
  void sense(const DepthFrame&, const FrameView&) override {}
  void makeSurfels() override {}
  void findBlocks() override {}
  TouchedBlocks lookUpBlocks() override {
    const size_t count = script_.requests.size();
    return {count, script_.requests, count};
  }
  void seeFree(std::vector<Vec3i>) override {}
  void reserveFrame(const FusionPass&) override { need(!script_.lacks_frame); }
  void castFoldAndClear(const FusionPass&) override {
    if (script_.lacks_host) throw std::bad_alloc();
  }
  FrameOutcome takeOutcome() override { return {}; }
  void takeColours(const ColourFrame&) override {}
  SeenColours look(const PaintView&) override { return {}; }
  void paint(const Exposure&) override {}
  void render(const ViewRequest&, RenderedView&) override {}
  void markAll(const MeshMarks&) override {}
  void beginMesh(int32_t) override {}
  void waitForMeshes() override {}
  MeshUpdate finishMesh() override { return {}; }
  void reserve(const MemoryDemand&) override { need(!script_.lacks_blocks); }
  void follow(const TableChanges& changes) override {
    if (changes.new_arrays != nullptr) script_.entered = changes.slots;
  }
  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>&, const RegionView&) override {
    return {};
  }
  void copyOut(const ContentsOrder&, MapContents&, MeshStates*) override {}
  void copyIn(const ContentsOrder&, const MapContents&, const MeshStates*) override {}
  std::vector<PackedKey> neededKeys(const std::vector<PackedKey>&, uint64_t) override { return {}; }
  std::vector<PackedKey> alignedKeys(const FrameView&, float) override { return {}; }
  std::vector<MarkedSlot> marked(bool) override { return {}; }
  void setMarks(const std::vector<MarkedSlot>&) override {}

 private:
  static void need(bool memory) {
    if (!memory) throw BackendError(true, "no memory");
  }

  Script& script_;
};

}  // namespace dtsdf
