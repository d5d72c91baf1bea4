/// Implements the mapper with a backend, which provides the loops and the memory. The engine
/// decides which blocks the map contains, enforces the budget and calls the stages.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "backend/frame_check.h"
#include "backend/map_backend.h"
#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "engine/mesh_parts.h"
#include "engine/pager.h"
#include "kernels/colour/colour_rules.h"
#include "level/pose_convention.h"
#include "space/space_map.h"
#include "threads/helper.h"

namespace dtsdf {

class Engine : public ProbedMapper {
 public:
  /// @param threads Number of host threads that compute distances and read blocks from disk.
  Engine(const MapperParams& params, const Rules& rules, int threads, BackendMaker make_backend);

  IntegrationResult integrate(const DepthFrame& frame) override;
  Alignment align(const DepthFrame& frame, const PosePrior& prior) override;
  IntegrationResult paint(const ColourFrame& frame) override;
  void render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
              RenderedView& view) override;
  void beginMeshUpdate() override;
  void waitForMeshes() override { ready().waitForMeshes(); }
  bool isMeshMade() const override { return backend_ != nullptr && traits_.meshes_at_once; }
  MeshUpdate finishMeshUpdate() override;
  ClearedRegion clearRegion(const Region& region) override;
  void clear() override;
  MapContents contents() override;
  MapContents outline() override;
  MapContents part(const std::vector<MapBlock>& blocks) override;
  void restore(const MapParts& parts) override;
  Space* space() override;
  MapStats stats() const override { return stats_; }
  void profileTo(Profile* profile) override;
  MapperMemory memory() const override;
  std::string backendName() const override { return traits_.name; }
  void restrictTo(const MapExtent& extent) override;
  uint64_t supportingFrames() const override { return state_.supporting_frames; }

 private:
  /// State of one map; clear() resets it.
  struct State {
    uint64_t refused = 0, dropped = 0;
    uint64_t frames = 0;                 ///< Frames fused, including those that only clear.
    uint64_t supporting_frames = 0;      ///< Frames that touched a block.
    std::optional<RegionView> kept;      ///< Sphere outside which to drop blocks, if any.
    Exposure exposure = sameExposure();  ///< Gains of the last colour image.
    bool has_colours = false;            ///< Whether anything was painted.

    bool is_meshing = false;      ///< Whether an extraction was begun and not yet fetched.
    MeshUpdate made;              ///< Meshes of that extraction so far.
    int32_t min_evidence = 0;     ///< Minimum evidence in the last extraction.
    std::vector<int32_t> vacant;  ///< Blocks to release after the last part is fetched.
    bool was_viewed = false;      ///< Whether render() ran since the last extraction.

    /// Views that contain all blocks marked for meshing. Without a value, the blocks may be
    /// anywhere.
    std::optional<std::vector<FrameView>> changed_in{std::in_place};
    std::vector<MarkedKey> waiting;        ///< Blocks left for the next part of an extraction.
    std::vector<MarkedKey> undone;         ///< Blocks to mesh again after loading failed.
    PackedKey next_turn = 0;               ///< First block of the next part.
    bool has_moved_in_background = false;  ///< Whether blocks moved since the last frame.
  };

  MapBackend& ready();
  MapBackend& made();
  void noteStats();
  IntegrationResult timed(const std::function<IntegrationResult()>& take);
  int32_t minEvidenceNow() const;

  // Depth images, and their pending work, which is done when the map is next used.
  IntegrationResult fuse(const DepthFrame& frame);
  std::vector<int32_t> prepareForFrame(const FrameView& view);
  std::vector<int32_t> blocksInView(const FrameView& view) const;
  void loadForFrame(const FrameView& view, TouchedBlocks& touched, std::vector<int32_t>& in_view);
  void admit(TouchedBlocks& touched, const std::vector<int32_t>& in_view);
  void keep(const DepthFrame& frame, const FrameView& view);
  void applyPendingWork();
  std::vector<int32_t> takeOutcome();
  std::vector<int32_t> releaseUnseen();
  std::vector<int32_t> dropBeyond();

  // Colour images.
  IntegrationResult paintSurfaces(const ColourFrame& frame);
  void admitColours(std::vector<ColourRequest> requests);
  void keepColours();

  // Meshes.
  void prepareForMesh();
  void markAllDirty();
  void loadForMesh();
  void finishMeshing();

  // Blocks on disk, with map/page_folder only.
  size_t require(const std::vector<PackedKey>& keys);
  bool makeRoom(size_t bytes);
  void moveInBackground();

  // The map as a whole.
  void clearSlots(const std::vector<int32_t>& slots, const RegionView& view, ClearedRegion& result);
  void addPart(const MapContents& part);

  const MapperParams params_;
  const Rules rules_;
  const PaintSettings paint_settings_;
  const BackendMaker make_backend_;
  BackendTraits traits_;
  BlockTable table_;
  std::unique_ptr<MapBackend> backend_;  ///< Null after clear() until made() runs.
  std::unique_ptr<SpaceMap> space_;      ///< Null without space/enabled.
  std::unique_ptr<Pager> pager_;         ///< Null without map/page_folder.
  State state_;
  PoseConvention convention_;
  MapStats stats_;  ///< From the last call that changed the map.
  Profile* profile_ = nullptr;
  mutable Helper helper_;  ///< Moves blocks between frames. Last member, as it uses all others.
};

}  // namespace dtsdf
