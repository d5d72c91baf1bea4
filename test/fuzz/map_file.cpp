// Fuzzes map files, given as bytes or as a recipe (map_recipe.h), and a mapper that continues from
// the loaded map, whose voxels may contain arbitrary bits.
#include "dtsdf_mapping/io/map_file.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "fuzz/fuzz_input.h"
#include "fuzz/map_recipe.h"
#include "fuzz/mesh_check.h"

using namespace dtsdf;

namespace {

constexpr int kMax_mb = 2;

MapperParams paramsOf(const MapContents& contents) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.threads = 1;
  params.map.max_memory_mb = kMax_mb;
  params.mesh.min_support = 1;
  params = withSettingsOf(contents, params);
  if (contents.cell_voxels != 0) {
    params.space.enabled = true;
    params.space.cell_voxels = contents.cell_voxels;
    params.space.max_range_m = 20.0f * params.map.voxel_size_m;
    params.space.max_distance_m = 3.0f * params.map.voxel_size_m;
  }
  // If space/enabled is set, a part of the budget is reserved for free cells.
  params.map.max_memory_mb = std::max(kMax_mb, minMemoryMb(contents, params));
  return params;
}

/// Checks that the distance is 0 in surface cells and only there.
void checkSpaceOf(Mapper& mapper) {
  if (mapper.space() == nullptr) return;
  mapper.space()->updateDistances();
  for (const SpaceCell& known : mapper.space()->cells()) {
    const int squared = mapper.space()->squaredDistance(known.cell);
    require((squared == 0) == (known.state == CellState::kSurface),
            "distance 0 in all surface cells, and only there");
  }
}

void checkMeshOf(Mapper& mapper, MeshStore& store) {
  store.apply(mapper.updateMesh());
  checkMesh(store.assemble());
  checkChunks(store);
  checkSpaceOf(mapper);
}

void checkBudgetOf(const Mapper& mapper, const MapperParams& params) {
  const MapStats stats = mapper.stats();
  require(stats.map_bytes + stats.free_bytes <= static_cast<size_t>(params.map.max_memory_mb) << 20,
          "the map is within its budget");
}

/// Fuses an image of a wall, taken from the origin.
void fuseWall(Mapper& mapper) {
  constexpr int kWidth = 12, kHeight = 9;
  const std::vector<uint16_t> depth_mm(kWidth * kHeight, 800);
  DepthFrame frame;
  frame.data = depth_mm.data();
  frame.row_bytes = kWidth * sizeof(uint16_t);
  frame.width = kWidth;
  frame.height = kHeight;
  frame.encoding = DepthEncoding::kUint16;
  frame.unit_m = 0.001f;
  frame.intrinsics = {15.0f, 15.0f, 5.5f, 4.0f};
  frame.T_W_C = Eigen::Isometry3d::Identity();
  require(mapper.integrate(frame).status == FrameStatus::kFused, "the frame is fused");
}

/// Checks that a mapper with the given contents returns them unchanged, extracts a valid mesh, and
/// fuses another frame.
void continueFrom(const MapContents& contents) {
  const auto mapper = makeMapper(paramsOf(contents), contents);
  const MapContents held = mapper->contents();
  require(contentHash(held, 1) == contentHash(contents, 1), "the map is unchanged");
  MeshStore store(paramsOf(contents).map.voxel_size_m);
  checkMeshOf(*mapper, store);
  checkBudgetOf(*mapper, paramsOf(contents));
  // With smaller voxels, the frame would touch too many blocks.
  if (store.voxelSize() < 0.05f) return;
  fuseWall(*mapper);
  checkMeshOf(*mapper, store);
  checkBudgetOf(*mapper, paramsOf(contents));
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  constexpr char kMagic[] = "DTSDFREC";
  const bool is_file = size >= 8 && std::equal(kMagic, kMagic + 8, data);
  const std::vector<uint8_t> bytes =
      is_file ? std::vector<uint8_t>(data, data + size) : MapRecipe(data, size).file();
  const InputFile file(bytes.data(), bytes.size());
  expectAnswer([&] { readMapInfo(file.path()); });
  std::optional<MapContents> contents;
  expectAnswer([&] { contents = loadMap(file.path(), size_t{kMax_mb} << 20, 1); });
  if (contents) continueFrom(*contents);  // a mapper must accept every map that loads
  return 0;
}
