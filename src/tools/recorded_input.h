/// What a program reads: a recording in a folder or a bag, as its options and settings say,
/// levelled where these ask for it.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "tools/run_options.h"

namespace dtsdf {

/// Takes a guess at the format of what is read, if none is given.
/// @throws std::runtime_error for what is no recording, UsageError for options of other formats.
void completeInput(RunOptions& options);

/// The depth images. @pre The options are complete. @throws std::runtime_error
std::unique_ptr<FrameSource> openFrames(const RunOptions& options, const NodeParams& node);

/// The depth images, after one look: what is there goes to standard output, what is implausible to
/// standard error, as a warning of `program`.
std::unique_ptr<FrameSource> openAndLook(const RunOptions& options, const RunSettings& settings,
                                         const std::string& program);

/// Up in the frame that the poses are in, as an inertial sensor measures it.
/// @throws std::runtime_error where there is none, as in folders, with what to do.
Eigen::Vector3d measuredUp(const RunOptions& options, const NodeParams& node);

/// The name of the frame that the poses are in; those of folders say none.
std::string nameOfFrame(const RunOptions& options, const RunSettings& settings);

/// The colour images; null where there are none, or none are wanted.
/// @throws std::runtime_error, also where there have to be some.
std::unique_ptr<ColourSource> openColours(const RunOptions& options, const NodeParams& node);

/// Where the poses' frame M lies in the level frame W; none where the settings ask for no level. It
/// is found by a look at the recording of its own, so that all frames are fused in W, and printed.
/// Where space is kept in a frame that is hardly level, a warning of `program` says so.
/// @pre The options are complete. @throws std::runtime_error if up cannot be found.
std::optional<Eigen::Isometry3d> findLevel(const RunOptions& options, const RunSettings& settings,
                                           const std::string& program);

/// Finds the level in the same way, and prints nothing but the warning.
std::optional<Eigen::Isometry3d> lookForLevel(const RunOptions& options,
                                              const RunSettings& settings,
                                              const std::string& program);

/// The frames of `source` with poses in W; `source` itself where there is no level.
std::unique_ptr<FrameSource> levelled(std::unique_ptr<FrameSource> source,
                                      const std::optional<Eigen::Isometry3d>& T_W_M);

/// Colour images with poses in W in the same way; null stays null.
std::unique_ptr<ColourSource> levelled(std::unique_ptr<ColourSource> source,
                                       const std::optional<Eigen::Isometry3d>& T_W_M);

}  // namespace dtsdf
