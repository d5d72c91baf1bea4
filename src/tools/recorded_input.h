/// Opens the recording named in a program's options, a folder or a bag, and levels it if the
/// settings require that.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "tools/run_options.h"

namespace dtsdf {

/// Detects the format of the recording if none is given.
/// @throws std::runtime_error if it is not a recording, UsageError for options of other formats.
void completeInput(RunOptions& options);

/// Opens the depth images. @pre The options are complete. @throws std::runtime_error if they cannot
/// be opened.
std::unique_ptr<FrameSource> openFrames(const RunOptions& options, const NodeParams& node);

/// Opens the depth images. Prints statistics of the first images to standard output, and warnings
/// to standard error.
std::unique_ptr<FrameSource> openAndInspect(const RunOptions& options, const RunSettings& settings);

/// The up direction in the frame of the poses, measured by an IMU.
/// @throws std::runtime_error that says what to do if there is no IMU, as for folders.
Eigen::Vector3d measuredUp(const RunOptions& options, const NodeParams& node);

/// The name of the poses' frame; empty for folders, unless the settings name it.
std::string nameOfFrame(const RunOptions& options, const RunSettings& settings);

/// Opens the colour images; null if there are none, or none are wanted.
/// @throws std::runtime_error, for example if they are required and missing.
std::unique_ptr<ColourSource> openColours(const RunOptions& options, const NodeParams& node);

/// Finds T_W_M, from the frame M of the poses to the level frame W; nullopt if the settings ask for
/// no level. Opens the recording separately, so that all its frames can be fused in W. Prints the
/// result.
/// @pre The options are complete. @throws std::runtime_error if the level cannot be found.
std::optional<Eigen::Isometry3d> findLevel(const RunOptions& options, const RunSettings& settings);

/// Like findLevel(), but prints nothing.
std::optional<Eigen::Isometry3d> detectLevel(const RunOptions& options,
                                             const RunSettings& settings);

/// The frames of `source` with poses in W; `source` itself if there is no level.
std::unique_ptr<FrameSource> levelled(std::unique_ptr<FrameSource> source,
                                      const std::optional<Eigen::Isometry3d>& T_W_M);

/// The colour images of `source` with poses in W; null if `source` is null.
std::unique_ptr<ColourSource> levelled(std::unique_ptr<ColourSource> source,
                                       const std::optional<Eigen::Isometry3d>& T_W_M);

}  // namespace dtsdf
