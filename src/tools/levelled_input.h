/// Levels what programs read: poses of frames and images, before any of them reaches a map.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "tools/input_options.h"

namespace dtsdf {

/// Where the poses' frame M lies in the level frame W; none where the settings ask for no level. It
/// is found by a look at the recording of its own, so that all frames are fused in W, and printed.
/// Where space is kept in a frame that is hardly level, a warning of `program` says so.
/// @pre The options are complete. @throws std::runtime_error if up cannot be found.
std::optional<Eigen::Isometry3d> findLevel(const InputOptions& options, const RunSettings& settings,
                                           const std::string& program);

/// The same frames with poses in W; `source` itself where there is no level.
std::unique_ptr<FrameSource> levelled(std::unique_ptr<FrameSource> source,
                                      const std::optional<Eigen::Isometry3d>& T_W_M);

/// The same of colour images; null stays null.
std::unique_ptr<ColourSource> levelled(std::unique_ptr<ColourSource> source,
                                       const std::optional<Eigen::Isometry3d>& T_W_M);

}  // namespace dtsdf
