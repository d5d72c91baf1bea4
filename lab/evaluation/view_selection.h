/// The options that choose images of a recording, which programs have in common.
#pragma once

#include "dtsdf_mapping/io/frame_source.h"
#include "program/command_line.h"

namespace dtsdf {

/// --first, --last and --step.
void addSelectionOptions(CommandLine& line, FrameSelection& frames);

/// The indices of the chosen images out of `count`. @throws UsageError if there is none.
std::vector<size_t> selectViews(const FrameSelection& frames, size_t count);

}  // namespace dtsdf
