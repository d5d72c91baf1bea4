#include "params/node_params.h"

#include "params/frame_name.h"

namespace dtsdf {

MappingParams readMappingParams(const ParamTree& tree,
                                const std::vector<ParamViolation>& violations) {
  MappingParams params;
  ParamReader reader(tree);
  visitParams(params, reader);
  checkParams(params.mapper, reader);
  for (const auto& [key, rule] : violations) reader.addViolation(key, rule);

  NodeParams& node = params.node;
  node.map_frame = stripLeadingSlash(node.map_frame);
  node.input.camera_frame = stripLeadingSlash(node.input.camera_frame);
  if (node.map_frame.empty()) reader.addViolation("map_frame", "must not be empty");
  if (node.output_directory.empty()) reader.addViolation("output_directory", "must not be empty");
  reader.finish();
  return params;
}

}  // namespace dtsdf
