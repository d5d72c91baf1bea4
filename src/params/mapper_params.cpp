#include "dtsdf_mapping/params/mapper_params.h"

#include "params/param_copy.h"

namespace dtsdf {
namespace {

void checkSpace(const MapperParams& params, ParamReader& reader) {
  const int cell = params.space.cell_voxels;
  if (cell != 1 && cell != 2 && cell != 4 && cell != 8) {
    reader.addViolation("space/cell_voxels", "must be 1, 2, 4 or 8");
  }
  if (!params.space.enabled) return;  // the limits below then do not matter
  const float cell_m = params.map.voxel_size_m * static_cast<float>(cell);
  constexpr float kMaxCellsInView = 1024.0f;
  if (params.space.max_range_m > kMaxCellsInView * cell_m) {
    reader.addViolation("space/max_range_m",
                        "must be at most 1024 cells; lower it, or raise space/cell_voxels");
  }
  constexpr float kMaxCells = 255.0f;  // squared distances have 16 bits
  if (params.space.max_distance_m > kMaxCells * cell_m) {
    reader.addViolation("space/max_distance_m",
                        "must be at most 255 cells; lower it, or raise space/cell_voxels");
  }
}

}  // namespace

void checkParams(const MapperParams& params, ParamReader& reader) {
  if (params.fusion.min_depth_m >= params.fusion.max_depth_m) {
    reader.addViolation("fusion/min_depth_m", "must be less than fusion/max_depth_m");
  }
  if (params.map.keep_radius_m != 0.0f && params.map.keep_radius_m < params.fusion.max_depth_m) {
    reader.addViolation("map/keep_radius_m", "must be 0 (off) or at least fusion/max_depth_m");
  }
  checkSpace(params, reader);
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
