/// Measures the host time of each stage; with a GPU, only the stages that the engine runs itself.
#pragma once

#include <chrono>

namespace dtsdf {

/// The stages of align(), integrate(), paint(), render() and a mesh update, in this order.
enum class Stage {
  kAlign,        ///< Aligning an image.
  kSense,        ///< Computing image noise, inverse depth, row fits and free depth.
  kMakeSurfels,  ///< Computing merged pixels, column fits and surfels.
  kFindBlocks,   ///< Finding the blocks that surfels touch, and those that the map lacks.
  kSeeFree,      ///< Finding the cells that are free according to the image.
  kAdmit,        ///< Creating blocks and arrays, and allocating their memory.
  kCast,         ///< Casting into, folding and clearing the touched blocks.
  kClear,        ///< Clearing other blocks in view, and dropping distant blocks.
  kPaint,        ///< Painting a colour image.
  kRender,       ///< Rendering a view of the map.
  kIndex,        ///< Selecting blocks to mesh, and computing their marching-cubes cases.
  kMake,         ///< Computing vertices and triangles.
  kReturn,       ///< Collecting the meshes that changed.
  kFindCells,    ///< Finding the cells through which the new meshes pass.
};
constexpr int kStageCount = static_cast<int>(Stage::kFindCells) + 1;

const char* toString(Stage stage);

/// Total time of each stage, in milliseconds.
struct Profile {
  double ms[kStageCount] = {};

  void add(Stage stage, double duration_ms) { ms[static_cast<int>(stage)] += duration_ms; }
  double of(Stage stage) const { return ms[static_cast<int>(stage)]; }
};

/// Adds the wall time of its own lifetime to a stage; does nothing if the profile is null.
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
