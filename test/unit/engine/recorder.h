/// A backend that only writes down what it is asked, and answers as a test wants it to.
#pragma once

#include <new>
#include <string>
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

  std::string name() const override { return "recorder"; }
  void enter() override {}
  void profileTo(Profile*) override {}
  void addMemory(std::vector<MemoryPart>&) const override {}
  void takePoints(const DepthFrame&, const FrameView&) override { note("take points"); }
  AlignmentSums sumsAt(const FrameView&, float) override { return {}; }
  void sense(const DepthFrame&, const FrameView&) override { note("sense"); }
  void makeSurfels() override { note("make surfels"); }
  void findBlocks() override { note("find blocks"); }
  void lookUpBlocks() override { note("look up blocks"); }
  void seeFree(std::vector<Vec3i>) override { note("see free"); }
  TouchedCounts touched() override {
    note("touched");
    const size_t count = script_.requests.size();
    return {count, count, count, count};
  }
  std::vector<BlockRequest> requests() override { return script_.requests; }
  void reserveFrame(const FrameTurn&) override { need(!script_.lacks_frame); }
  void castFoldAndClear(const FrameTurn& turn) override {
    note("cast, fold, clear");
    if (script_.lacks_host) throw std::bad_alloc();
    script_.frame_number = turn.number;
    script_.in_view = turn.in_view;
  }
  std::vector<EmptyBlock> takeEmpty() override { return std::move(script_.empty); }
  bool hasMirror() const override { return script_.has_mirror; }
  std::vector<FreeCube> takeFree() override { return {{{0, 0, 0}, {{1}}}}; }
  void takeColours(const ColourFrame&) override { note("take colours"); }
  SeenColours look(const ColourLook&) override {
    note("look");
    return {!script_.colour_requests.empty(), {}};
  }
  std::vector<ColourRequest> colourRequests() override { return script_.colour_requests; }
  void paint(const Exposure&) override { note("paint"); }
  void render(const ViewRequest&, RenderedView&) override { note("render"); }
  void markAllDirty() override { note("mark all"); }
  void keepColours() override { note("keep colours"); }
  void beginMesh(int32_t) override { note("begin mesh"); }
  void waitForMeshes() override {}
  MeshUpdate finishMesh() override {
    note("finish mesh");
    return {};
  }
  void reserve(const MapDemand&) override { need(!script_.lacks_blocks); }
  void reserveColours(size_t) override {}
  void reserveChanges(size_t) override {}
  void enterBlocks(const std::vector<int32_t>& slots, const std::vector<int32_t>& arrays) override {
    note("admit");
    script_.entered = slots;
    script_.zeroed = arrays;
  }
  void enterColours(const std::vector<NewBrick>&) override { note("admit colours"); }
  void follow(const ChangedSlots& changed) override { script_.followed = changed.slots; }
  std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                        const RegionView&) override {
    note("empty region");
    return std::vector<EmptiedBlock>(slots.size(), EmptiedBlock{1, 63});
  }
  void copyOut(const ContentsOrder&, MapContents&) override { note("copy out"); }
  void copyIn(const ContentsOrder&, const MapContents&) override { note("copy in"); }

 private:
  void note(const char* call) { script_.calls.push_back(call); }
  static void need(bool memory) {
    if (!memory) throw BackendError(true, "no memory");
  }

  Script& script_;
};

}  // namespace dtsdf
