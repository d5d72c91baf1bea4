#include "dtsdf_mapping/params/mapper_params.h"

#include "params/param_copy.h"

namespace dtsdf {

void checkParams(const MapperParams& params, ParamReader& reader) {
  if (params.fusion.min_depth_m >= params.fusion.max_depth_m) {
    reader.addViolation("fusion/min_depth_m", "must be less than fusion/max_depth_m");
  }
  if (params.map.keep_radius_m != 0.0f && params.map.keep_radius_m < params.fusion.max_depth_m) {
    reader.addViolation("map/keep_radius_m",
                        "must be 0 (off) or at least fusion/max_depth_m, else what a frame maps "
                        "is dropped at once");
  }
}

MapperParams readMapperParams(const ParamTree& tree) {
  MapperParams params;
  ParamReader reader(copyOf(tree));
  visitParams(params, reader);
  checkParams(params, reader);
  reader.finish();
  return params;
}

}  // namespace dtsdf
