/// The mapper: what is in the map, what it may cost, and the order of the stages, over a backend
/// that has the loops and the memory.
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
  /// @param threads Threads of the host, for space.
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
  std::vector<MemoryPart> memoryParts() const override;
  std::string backendName() const override { return traits_.name; }
  void restrictTo(const MapExtent& extent) override;
  uint64_t supportingFrames() const override { return state_.supporting_frames; }

 private:
  /// What belongs to one map: clear() begins another.
  struct State {
    uint64_t refused = 0, dropped = 0;
    uint64_t frames = 0;                 ///< Fused, those included that only clear.
    uint64_t supporting_frames = 0;      ///< Those that touched a block.
    std::optional<RegionView> kept;      ///< After a frame, until what lies beyond is dropped.
    Exposure exposure = sameExposure();  ///< From the last colour image.
    bool has_colours = false;            ///< Something was painted.

    bool is_meshing = false;      ///< An extraction was begun, and not fetched.
    MeshUpdate made;              ///< What is known early of that extraction.
    int32_t least_evidence = 0;   ///< What the last extraction asked for.
    std::vector<int32_t> vacant;  ///< Released when all parts of an extraction are fetched.
    bool was_viewed = false;      ///< Since the last extraction.

    /// Depth images in whose views all lies that is marked; none: somewhere else, too.
    std::optional<std::vector<FrameView>> changed_in{std::in_place};
    std::vector<MarkedKey> waiting;  ///< What an extraction leaves to its next part.
    std::vector<MarkedKey> undone;   ///< Meshed without all that it depends on: to do again.
    PackedKey next_turn = 0;         ///< Where the next part begins.
    bool has_moved_between = false;  ///< Blocks have, since the last frame.
  };

  MapBackend& ready();
  MapBackend& made();
  void noteStats();
  IntegrationResult timed(const std::function<IntegrationResult()>& take);
  int32_t leastEvidenceNow() const;

  // A depth image, and what it leaves to be done when the map is looked at next.
  IntegrationResult fuse(const DepthFrame& frame);
  std::vector<int32_t> prepareForFrame(const FrameView& view);
  std::vector<int32_t> blocksInView(const FrameView& view) const;
  bool loadForFrame(const FrameView& view, TouchedBlocks& touched, std::vector<int32_t>& in_view);
  void admit(TouchedBlocks& touched, const std::vector<int32_t>& in_view);
  void keep(const DepthFrame& frame, const FrameView& view, bool has_moved_blocks);
  void applyPendingWork();
  std::vector<int32_t> takeOutcome();
  std::vector<int32_t> releaseUnseen();
  std::vector<int32_t> dropBeyond();

  // A colour image.
  IntegrationResult paintSurfaces(const ColourFrame& frame);
  void admitColours(std::vector<ColourRequest> requests);
  void keepColours();

  // Meshes.
  void prepareForMesh();
  void markAllDirty();
  void loadForMesh();
  void finishMeshing();

  // Blocks on disk: none of it happens without map/page_folder.
  size_t require(const std::vector<PackedKey>& keys);
  bool makeRoom(size_t bytes);
  void moveBeside();

  // The map as a whole.
  void clearSlots(const std::vector<int32_t>& slots, const RegionView& view, ClearedRegion& result);
  void enterPart(const MapContents& part);

  const MapperParams params_;
  const Rules rules_;
  const PaintSettings paint_settings_;
  const BackendMaker make_backend_;
  BackendTraits traits_;
  BlockTable table_;
  std::unique_ptr<MapBackend> backend_;  ///< Null after clear(), until it is used: see ready().
  std::unique_ptr<SpaceMap> space_;      ///< Null where nobody asks for it.
  std::unique_ptr<Pager> pager_;         ///< Null without map/page_folder.
  State state_;
  PoseConvention convention_;
  MapStats stats_;  ///< After the last call that changes the map.
  Profile* profile_ = nullptr;
  mutable Helper helper_;  ///< Moves blocks between frames: ends before what it works on.
};

}  // namespace dtsdf
