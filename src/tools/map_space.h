/// What is known of space in a saved map, for programs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// A mapper that was made from a file, with its surfaces, and the space around them: that which the
/// file holds, and none where it was saved without. `given` are settings in place of its own, each
/// key=value.
/// @throws std::runtime_error if the file cannot be read, ParamError for wrong settings.
std::unique_ptr<Mapper> loadWithSpace(const std::string& map_path,
                                      const std::vector<std::string>& given);

}  // namespace dtsdf
