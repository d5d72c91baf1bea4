/// Time by stages on the host, for those who ask. Nobody else pays for it.
#pragma once

#include <chrono>

namespace dtsdf {

/// The stages of integrate(), of paint(), of render() and of a mesh update on the host, in their
/// order.
enum class Stage {
  kAlign,        ///< The pose at which the image fits the map.
  kSense,        ///< Noise of the image, inverse depth and row fits, and how far rays are free.
  kMakeSurfels,  ///< Which pixels are merged, column fits, and surfels.
  kFindBlocks,   ///< Blocks that surfels touch, and what of them the map lacks.
  kSeeFree,      ///< Which cells of space the image sees through.
  kAdmit,        ///< New blocks and arrays, and their memory; with waiting for the device.
  kCast,         ///< Surfels into sums; also fold and clear of the blocks that they touch.
  kClear,        ///< Voxels that were seen as free, what changed, and what is empty.
  kPaint,        ///< A colour image onto the surfaces that it sees.
  kRender,       ///< A view of the map from a pose.
  kIndex,        ///< Which blocks to mesh again, and the marching cubes indices in them.
  kMake,         ///< Vertices and triangles.
  kReturn,       ///< Meshes into blocks.
  kFindCells,    ///< Cells of space that the new meshes pass through.
};
constexpr int kStageCount = static_cast<int>(Stage::kFindCells) + 1;

const char* toString(Stage stage);

/// Sums of times, until whoever asked for them resets them.
struct Profile {
  double ms[kStageCount] = {};

  void add(Stage stage, double duration_ms) { ms[static_cast<int>(stage)] += duration_ms; }
  double of(Stage stage) const { return ms[static_cast<int>(stage)]; }
};

/// Adds the wall time of its own lifetime to a stage; does nothing without a profile.
class StageTimer {
 public:
  StageTimer(Profile* profile, Stage stage) : profile_(profile), stage_(stage) {
    if (profile_ != nullptr) start_ = Clock::now();
  }
  ~StageTimer() {
    if (profile_ == nullptr) return;
    profile_->add(stage_, std::chrono::duration<double, std::milli>(Clock::now() - start_).count());
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  Profile* profile_;
  Stage stage_;
  Clock::time_point start_;
};

}  // namespace dtsdf
