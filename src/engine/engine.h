/// The mapper: what is in the map, what it may cost, and the order of the stages, over a backend
/// that has the loops and the memory.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <unordered_set>

#include "backend/frame_check.h"
#include "backend/map_backend.h"
#include "backend/mapper_probe.h"
#include "backend/rules.h"
#include "engine/mesh_parts.h"
#include "engine/pager.h"
#include "kernels/colour/colour_rules.h"
#include "space/space_map.h"
#include "threads/helper.h"

namespace dtsdf {

class Engine : public ProbedMapper {
 public:
  /// @param threads Of the host, for space.
  Engine(const MapperParams& params, const Rules& rules, int threads, BackendMaker make_backend);

  IntegrationResult integrate(const DepthFrame& frame) override;
  Alignment align(const DepthFrame& frame, const PosePrior& prior) override;
  IntegrationResult paint(const ColourFrame& frame) override;
  void render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
              RenderedView& view) override;
  void beginMeshUpdate() override;
  void waitForMeshes() override { ready().waitForMeshes(); }
  bool isMeshMade() const override { return backend_ != nullptr && backend_->makesMeshAtOnce(); }
  MeshUpdate finishMeshUpdate() override;
  ClearedRegion clearRegion(const Region& region) override;
  void clear() override;
  MapContents contents() override;
  MapContents outline() override;
  MapContents part(const std::vector<MapBlock>& blocks) override;
  void restore(const MapContents& contents) override;
  void restore(const MapParts& parts) override;
  Space* space() override { return space_.get(); }
  MapStats stats() const override;
  void profileTo(Profile* profile) override;
  std::vector<MemoryPart> memoryParts() const override;
  std::string backendName() const override { return name_; }
  void restrictTo(const MapExtent& extent) override;
  const std::vector<BlockRequest>& outsideExtent() const override { return outside_; }
  void passOver(const PassedFrames& passed) override;

 private:
  /// Since the start or the last clear().
  struct Counters {
    uint64_t refused = 0, dropped = 0;
    uint64_t frames = 0;             ///< Fused, those included that only clear.
    uint64_t supporting_frames = 0;  ///< Those that touched a block.
  };

  MapBackend& ready();
  MapBackend& made();
  const Engine& settled() const;
  bool makeDistances(const DistanceTask& task, std::vector<SectorSquares>& squares);
  IntegrationResult timed(const std::function<IntegrationResult()>& take);

  // A depth image.
  IntegrationResult fuse(const DepthFrame& frame);
  void sense(const DepthFrame& frame, const FrameView& view);
  std::vector<int32_t> settleBefore(const FrameView& view);
  void seeFree(const FrameView& view);
  size_t admit(const TouchedCounts& touched, const FrameTurn& turn);
  bool hasRoomFor(const MapDemand& demand);
  void castFoldAndClear(const TouchedCounts& touched, const FrameTurn& turn);
  void keep(const DepthFrame& frame, const FrameView& view);

  // What it leaves to be done when the map is looked at next.
  void settle();
  void settleForMesh();
  std::vector<int32_t> vacateEmpty();
  std::vector<int32_t> releaseUnseen();
  void takeFree();
  std::vector<int32_t> dropBeyond();

  // A colour image.
  IntegrationResult paintSurfaces(const ColourFrame& frame);
  size_t admitColours();
  void enterColours(const std::vector<NewBrick>& bricks);
  void keepColours();

  // Blocks on disk: see engine_paging.cpp. None of it happens without map/page_folder.
  size_t bringInForFrame(const FrameView& view, const TouchedCounts& touched,
                         std::vector<int32_t>& in_view);
  bool hasAllOf(const FrameView& view);
  std::vector<PackedKey> pagedInView(const FrameView& view, float radius) const;
  std::vector<PackedKey> keysOfFrame(const FrameView& view, const std::vector<int32_t>& in_view);
  size_t bringInPart(size_t new_bytes);
  std::vector<int32_t> blocksOfPart(const FrameView& view) const;
  size_t fusePart(const FrameView& view, const TouchedCounts& touched);
  size_t bytesWanted(PackedKey key, size_t& next_request) const;
  std::vector<BlockRequest> requestsOfPart();
  size_t bringInForImage(const FrameView& view, std::vector<int32_t>& in_view);
  void bringInForView(const FrameView& view);
  AlignmentSums sumsAt(const FrameView& view, float cutoff);
  std::vector<PackedKey> keysAhead(const DepthFrame& frame, const Eigen::Isometry3d& motion);
  void noteForReading(const DepthFrame& frame, const FrameView& view);
  void moveAhead();
  std::vector<PackedKey> keysInView(const FrameView& view, float radius, float max_depth_m) const;
  std::vector<PackedKey> takeFarthest(const KeptBall& kept, std::vector<int32_t>& slots) const;
  size_t clearPaged(const RegionView& view, ClearedRegion& result);
  bool clearSome(std::vector<PackedKey>& keys, const RegionView& view, ClearedRegion& result);
  void moveBeside();
  void forgetWhatIsMarked() { marks_are_in_views_ = false; }
  void startViews();
  bool dependsOnDisk() const;
  void meshInParts();
  void meshThoseThatWaitFirst(const std::vector<MarkedKey>& marked);
  bool isEnough() const;
  void meshParts(std::vector<MarkedKey> marked, bool is_last);
  std::vector<PackedKey> pagedAround(const std::vector<MarkedKey>& marked) const;
  std::vector<PackedKey> neededFor(const std::vector<MarkedKey>& marked) const;
  enum class Want { kWaits, kRefused };
  void keepMarks(size_t left, Want want);
  size_t mostBytes(size_t blocks) const;
  bool fits(const std::vector<PackedKey>& keys) const;
  void finishMeshing();

  std::vector<int32_t> blocksInView(const FrameView& view) const;
  int32_t leastEvidenceNow() const;
  void markAllDirty();
  void enterContents(const MapContents& contents);
  void enterInParts(const MapContents& contents);
  void goOnFrom(const MapContents& head);
  void clearSlots(const std::vector<int32_t>& slots, const RegionView& view, ClearedRegion& result);

  const MapperParams params_;
  const Rules rules_;
  const PaintSettings paint_settings_;
  const BackendMaker make_backend_;
  std::string name_;  ///< Of the backend.
  BlockTable table_;
  std::unique_ptr<MapBackend> backend_;  ///< Null after clear(), until it is used: see ready().
  std::unique_ptr<SpaceMap> space_;      ///< Null where nobody asks for it.
  std::unique_ptr<Pager> pager_;         ///< Null without map/page_folder.
  std::vector<BlockRequest> requests_;   ///< Of the last frame; with a pager only.
  bool was_viewed_ = false;              ///< Since the last extraction.
  bool moves_blocks_ = false;            ///< The last frame does, so that requests are by key.
  std::vector<PackedKey> part_;          ///< Of that frame, by key; empty: it comes in one.
  Counters counters_;
  Exposure exposure_ = sameExposure();             ///< Of the last colour image.
  bool has_colours_ = false;                       ///< Something was painted.
  std::vector<BlockRequest> outside_;              ///< Of the last frame.
  std::optional<Eigen::Isometry3d> T_W_C_before_;  ///< Pose of the last frame; with a pager only.
  /// A frame that is to be read ahead of, whose image may have gone by then, and its motion since
  /// the one before.
  struct SeenFrame {
    DepthFrame frame;
    Eigen::Isometry3d motion;
  };
  std::optional<SeenFrame> ahead_of_;
  std::vector<FrameView> views_;    ///< Of depth images since the last extraction; the same.
  bool marks_are_in_views_ = true;  ///< Nothing beyond them waits for the next extraction.
  uint64_t lost_before_ = 0;        ///< Blocks on disk that the last extraction missed.
  std::optional<KeptBall> kept_;    ///< Of the last frame, until what lies beyond is dropped.
  bool has_free_ = false;           ///< What the last frame saw as free has not been taken yet.
  size_t requests_before_ = 0;      ///< Of the last frame.
  bool is_meshing_ = false;
  std::vector<MarkedKey> unfinished_;  ///< Meshed without all that they depend on: to do again.
  std::unordered_set<PackedKey> postponed_;  ///< Of these, those whose turn is first.
  MeshUpdate made_;  ///< Of the extraction under way, so far: those that were fetched early.
  int32_t least_evidence_ = 0;   ///< Of the last extraction.
  std::vector<int32_t> vacant_;  ///< Released when the extraction under way is fetched.
  Profile* profile_ = nullptr;
  bool moved_ahead_ = false;  ///< Blocks were, since the last frame.
  Helper helper_;             ///< Moves blocks between frames: ends before what it works on.
};

}  // namespace dtsdf
