/// Whether z of a map frame that is taken as it is can be up.
#pragma once

#include <optional>
#include <string>

#include "dtsdf_mapping/depth_frame.h"
#include "level/floor_search.h"

namespace dtsdf {

/// Looks at the first images, whose poses are in the map frame. By their floor, or where there is
/// none, by how the first camera stands: in a frame that is the first camera's own, z is where it
/// looks. One thread at a time.
class LevelDoubt {
 public:
  /// True once, when it has made up its mind.
  bool add(const DepthFrame& frame);

  /// Ends the look early, with the images that there were.
  void finish();

  /// What is doubtful, and what to do; empty where nothing is.
  const std::string& text() const { return text_; }

 private:
  FloorSearch search_;
  std::optional<Eigen::Isometry3d> first_T_W_C_;
  bool is_done_ = false;
  std::string text_;
};

}  // namespace dtsdf
