/// A mapper without voxels. Each frame changes one block, and calls can be made to fail.
#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/partly_cleared.h"

namespace dtsdf {

/// A free-space grid without known cells. Nevertheless, each of the next parts_left calls to
/// takeChanges() returns many cubes with one free cell each.
class FakeSpace : public Space {
 public:
  double cellSize_m() const override { return 0.1; }
  CellState stateOf(const Vec3i&) const override { return CellState::kUnknown; }
  std::vector<SpaceCell> cells() const override { return {}; }
  std::vector<SpaceCube> cubes(int32_t, int32_t) const override { return {}; }
  SpaceChanges takeChanges(bool) override {
    SpaceChanges changes{true, {}};
    if (parts_left == 0) return changes;
    for (int32_t x = 0; x < kCubesOfPart; ++x) {
      changes.cubes.push_back({{8 * x, 8 * parts_left, 0}, {1}, {}});
    }
    changes.begins_anew = parts_left == kParts;
    changes.is_part = --parts_left > 0;
    return changes;
  }
  void updateDistances() override {}
  int squaredDistance(const Vec3i&) const override { return -1; }
  SpaceDistance distanceAt(const Eigen::Vector3d&) const override { return {}; }
  size_t bytes() const override { return 0; }

  static constexpr int32_t kCubesOfPart = 40000;
  static constexpr int kParts = 3;
  int parts_left = 0;
};

class FakeMapper : public Mapper {
 public:
  IntegrationResult integrate(const DepthFrame& frame) override {
    throwIf(fails_to_integrate);
    ++frames;
    last_T_W_C = frame.T_W_C;
    changed_[static_cast<int>(frame.T_W_C.translation().x())] = frames;
    return {};
  }

  /// Calls `aligns` if set. Otherwise the frame keeps its pose, and the status is the default.
  Alignment align(const DepthFrame& frame, const PosePrior&) override {
    if (aligns) return aligns(frame);
    Alignment alignment;
    alignment.T_W_C = frame.T_W_C;
    return alignment;
  }

  IntegrationResult paint(const ColourFrame& frame) override {
    throwIf(fails_to_integrate);
    ++images;
    if (paints) paints(frame);
    return {};
  }

  void render(const RenderCamera&, const Eigen::Isometry3d&, RenderedView&) override {}

  void beginMeshUpdate() override {
    throwIf(fails_to_mesh);
    ++meshes;
  }

  /// Returns one triangle per changed block. The `edge` of its first vertex is set to the number of
  /// the frame that last changed the block.
  MeshUpdate finishMeshUpdate() override {
    throwIf(fails_to_mesh);
    MeshUpdate update;
    for (const auto& [x, frame] : changed_) {
      const auto edge = static_cast<uint32_t>(frame);
      update.blocks.push_back({{x, 0, 0},
                               {{{0, 0, 0}, edge}, {{1, 0, 0}, edge + 1}, {{0, 1, 0}, edge + 2}},
                               {0, 1, 2},
                               {}});
    }
    update.duration_ms = mesh_ms;
    update.is_part = parts_left > 0;
    if (update.is_part) --parts_left;
    changed_.clear();
    return update;
  }

  /// Counts the call, but clears nothing.
  ClearedRegion clearRegion(const Region&) override {
    throwIf(fails_to_clear);
    ++cleared_regions;
    if (clears_in_part) throw PartlyCleared("the disk");
    return {1, 1};
  }

  void clear() override {
    throwIf(fails_to_clear);
    frames = 0;
    changed_.clear();
  }

  /// The contents consist only of the number of frames.
  MapContents outline() override { return contents(); }
  MapContents part(const std::vector<MapBlock>&) override { return contents(); }
  MapContents contents() override {
    MapContents contents;
    contents.frames = static_cast<uint64_t>(frames);
    return contents;
  }

  Space* space() override { return has_space ? &known_space : nullptr; }
  static constexpr size_t kBudgetBytes = 5000;
  MapStats stats() const override {
    throwIf(fails_to_count);
    MapStats stats = counts;
    stats.blocks = stats.voxel_arrays = static_cast<size_t>(frames);
    stats.max_map_bytes = kBudgetBytes;
    return stats;
  }
  MapperMemory memory() const override {
    ++reports;
    return held;
  }
  std::string backendName() const override { return "fake"; }

  bool fails_to_integrate = false, fails_to_mesh = false, fails_to_clear = false;
  bool fails_to_count = false;
  bool clears_in_part = false;  ///< Makes clearRegion() throw PartlyCleared.
  bool has_space = false;
  std::function<Alignment(const DepthFrame&)> aligns;
  std::function<void(const ColourFrame&)> paints;
  int frames = 0, images = 0, meshes = 0, cleared_regions = 0;
  Eigen::Isometry3d last_T_W_C = Eigen::Isometry3d::Identity();  ///< Pose of the newest frame.
  mutable int reports = 0;                                       ///< Number of memory reports.
  int parts_left = 0;  ///< Number of extractions that will return only a part.
  double mesh_ms = 0.0;
  MapStats counts;  ///< Statistics that do not depend on the frames.
  MapperMemory held;

  FakeSpace known_space;

 private:
  static void throwIf(bool fails) {
    if (fails) throw std::runtime_error("out of memory");
  }

  std::map<int, int> changed_;  ///< Number of the last frame that changed a block, by block x.
};

}  // namespace dtsdf
