/// The settings of a map that is asked for space, as programs are given them.
#pragma once

#include "dtsdf_mapping/io/yaml_params.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "program/command_line.h"

namespace dtsdf {

/// --set KEY=VALUE, into a tree.
void addSettingOption(CommandLine& line, ParamTree& tree);

/// The mapper's settings, with space enabled. @throws ParamError for wrong ones.
MapperParams spaceParams(ParamTree tree);

}  // namespace dtsdf
