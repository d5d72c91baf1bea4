/// The settings to go on with a saved map, as the run that saved it would have.
#pragma once

#include <string>
#include <vector>

#include "backend/rules.h"
#include "dtsdf_mapping/map_contents.h"
#include "dtsdf_mapping/params/mapper_params.h"

namespace dtsdf {

/// What a mapper of a saved map is made with.
struct MapSettings {
  MapperParams params;
  Rules rules;
};

/// Those of the file, as far as this version knows them, and then those that are given, each
/// key=value. The budget is what the map needs. @throws ParamError with every violation.
MapSettings settingsFor(const MapContents& contents, const std::vector<std::string>& given);

}  // namespace dtsdf
