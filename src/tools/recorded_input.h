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
/// @throws std::runtime_error if it is not a recording, UsageError for options that do not apply to
/// its format.
void completeInput(RunOptions& options);

/// Opens the depth images. @pre completeInput() was called. @throws std::runtime_error if they
/// cannot be opened.
std::unique_ptr<FrameSource> openFrames(const RunOptions& options, const NodeParams& node);

/// Opens the depth images. Prints statistics of the first images to standard output, and warnings
/// to standard error.
std::unique_ptr<FrameSource> openAndInspect(const RunOptions& options, const RunSettings& settings);

/// The up direction in the frame of the poses, measured by an IMU.
/// @throws std::runtime_error if there is no IMU data, as in folders.
Eigen::Vector3d measuredUp(const RunOptions& options, const NodeParams& node);

/// The name of the frame of the poses; empty for folders, unless map_frame is given.
std::string nameOfFrame(const RunOptions& options, const RunSettings& settings);

/// Opens the colour images; null if there are none, or none are wanted.
/// @throws std::runtime_error, for example if they are required and missing.
std::unique_ptr<ColourSource> openColours(const RunOptions& options, const NodeParams& node);

/// Finds and prints the levelling transform T_W_M, from the frame M of the poses to the level frame
/// W; nullopt if map/level is none. Opens the recording separately, so that all its frames can be
/// fused in W.
/// @pre completeInput() was called. @throws std::runtime_error if the vertical cannot be found.
std::optional<Eigen::Isometry3d> findLevel(const RunOptions& options, const RunSettings& settings);

/// Like findLevel(), but prints nothing.
std::optional<Eigen::Isometry3d> detectLevel(const RunOptions& options,
                                             const RunSettings& settings);

/// The frames of `source` with poses in W; `source` itself if T_W_M is nullopt.
std::unique_ptr<FrameSource> levelled(std::unique_ptr<FrameSource> source,
                                      const std::optional<Eigen::Isometry3d>& T_W_M);

/// The colour images of `source` with poses in W; null if `source` is null.
std::unique_ptr<ColourSource> levelled(std::unique_ptr<ColourSource> source,
                                       const std::optional<Eigen::Isometry3d>& T_W_M);

}  // namespace dtsdf
