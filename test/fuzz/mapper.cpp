// The mapper itself: settings, depth and colour images with their poses, regions to be cleared, all
// from bytes. Whatever comes, it keeps its budget, its mesh is valid, and a mapper that is made of
// its contents makes the same one; and it gives the same bytes on two threads, which few inputs
// try: on a busy machine threads that wait for each other take a hundred times as long as the rest.
// Images are small and voxels large, since what then takes long is meshing.
#include "dtsdf_mapping/mapper.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <variant>
#include <vector>

#include "fuzz/fuzz_input.h"
#include "fuzz/mesh_check.h"
#include "support/same_bytes.h"

using namespace dtsdf;

namespace {

constexpr int kSteps = 3;

/// All is forgotten.
struct Clear {};

/// What is done to a mapper, and the pixels of it.
struct Step {
  std::vector<uint8_t> pixels;
  std::variant<DepthFrame, ColourFrame, Region, Clear> what;
};

/// Mostly what cameras have, sometimes any bits at all.
float takeNumber(InputBytes& bytes, float low, float high) {
  const uint8_t kind = bytes.take<uint8_t>();
  if (kind == 0xff) return bytes.take<float>();
  return low + (high - low) * static_cast<float>(bytes.take<uint16_t>()) / 65535.0f;
}

/// The same, held to a range; what is no number becomes its lower end.
float takeBetween(InputBytes& bytes, float low, float high, std::array<float, 2> range) {
  const float number = takeNumber(bytes, low, high);
  return number >= range[0] ? std::min(number, range[1]) : range[0];
}

Eigen::Isometry3d takePose(InputBytes& bytes) {
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 3; ++i) T_W_C.translation()[i] = takeNumber(bytes, -2.0f, 2.0f);
  Eigen::Vector3d axis;
  for (int i = 0; i < 3; ++i) axis[i] = takeNumber(bytes, -1.0f, 1.0f);
  const double angle = takeNumber(bytes, -3.2f, 3.2f);
  if (axis.allFinite() && axis.norm() > 0.0) {
    T_W_C.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  }
  if (bytes.take<uint8_t>() == 0xff) T_W_C.matrix()(bytes.choose(3), bytes.choose(4)) = 1e300;
  return T_W_C;
}

MapperParams takeParams(InputBytes& bytes) {
  MapperParams params;
  params.backend = Backend::kCpu;
  params.map.voxel_size_m = takeBetween(bytes, 0.08f, 0.4f, {0.05f, 1.0f});
  params.map.max_memory_mb = 1 + bytes.choose(2);
  params.map.directional = bytes.choose(4) != 0;
  const FusionMode modes[] = {FusionMode::kNormalRayCasting, FusionMode::kRayCasting,
                              FusionMode::kVoxelProjection};
  params.fusion.mode = modes[bytes.choose(3)];
  params.fusion.max_depth_m = 2.0f;
  params.fusion.clearing = bytes.choose(4) != 0;
  params.fusion.normal_radius_px = 1 + bytes.choose(5);
  params.mesh.min_support = 1 + bytes.choose(3);
  params.mesh.refine = bytes.choose(2);
  const Sensor sensors[] = {Sensor::kStructuredLight, Sensor::kStereo, Sensor::kTimeOfFlight};
  params.sensor.kind = sensors[bytes.choose(3)];
  params.map.truncation_voxels = takeBetween(bytes, 1.0f, 6.0f, {1.0f, 8.0f});
  const int choice = bytes.choose(4);
  params.map.keep_radius_m = choice == 1 ? 2.5f : 0.0f;
  params.space.enabled = choice != 0;
  params.space.cell_voxels = choice == 3 ? 1 : 4;
  params.space.max_distance_m = 0.5f;
  return params;
}

Region takeRegion(InputBytes& bytes) {
  const Eigen::Isometry3d T_W_R = takePose(bytes);
  if (bytes.choose(2) == 0) {
    const double radius_m = takeNumber(bytes, 0.0f, 2.0f);
    return SphereRegion{T_W_R.translation(), radius_m};
  }
  Eigen::Vector3d size_m;
  for (int i = 0; i < 3; ++i) size_m[i] = takeNumber(bytes, 0.0f, 3.0f);
  return BoxRegion{T_W_R, size_m};
}

Step takeImage(InputBytes& bytes) {
  Step image;
  const int width = 1 + bytes.choose(12), height = 1 + bytes.choose(9);
  const Intrinsics K{takeNumber(bytes, 5.0f, 40.0f), takeNumber(bytes, 5.0f, 40.0f),
                     takeNumber(bytes, 0.0f, 32.0f), takeNumber(bytes, 0.0f, 24.0f)};
  const Eigen::Isometry3d T_W_C = takePose(bytes);
  const int kind = bytes.choose(4);
  const size_t pixel_bytes = kind == 0 ? 3 : kind == 1 ? 4 : 2;
  image.pixels.resize(pixel_bytes * width * height);
  // A surface with what the bytes say on it, since few bytes make no image.
  for (size_t i = 0; i < image.pixels.size() / pixel_bytes; ++i) {
    const auto change = static_cast<int8_t>(bytes.take<uint8_t>());
    const uint16_t depth_mm = change == -128 ? 0 : static_cast<uint16_t>(1000 + 8 * change);
    uint8_t* const pixel = &image.pixels[i * pixel_bytes];
    if (kind == 1) {
      const float depth_m = change == 127 ? std::numeric_limits<float>::quiet_NaN()
                                          : 0.001f * static_cast<float>(depth_mm);
      std::memcpy(pixel, &depth_m, sizeof(depth_m));
    } else {
      std::memcpy(pixel, &depth_mm, sizeof(depth_mm));
    }
  }
  if (kind == 0) {
    ColourFrame frame;
    frame.data = image.pixels.data();
    frame.row_bytes = pixel_bytes * width;
    frame.width = width;
    frame.height = height;
    frame.intrinsics = K;
    frame.T_W_C = T_W_C;
    image.what = frame;
    return image;
  }
  DepthFrame frame;
  frame.data = image.pixels.data();
  frame.row_bytes = pixel_bytes * width;
  frame.width = width;
  frame.height = height;
  frame.encoding = kind == 1 ? DepthEncoding::kFloat32 : DepthEncoding::kUint16;
  frame.unit_m = kind == 1 ? 1.0f : 0.001f;
  frame.intrinsics = K;
  frame.T_W_C = T_W_C;
  image.what = frame;
  return image;
}

Step takeStep(InputBytes& bytes) {
  const int kind = bytes.choose(8);
  if (kind == 6) return {{}, takeRegion(bytes)};
  if (kind == 7) return {{}, Clear()};
  return takeImage(bytes);
}

/// What a run comes to.
struct Outcome {
  std::vector<FrameStatus> statuses;
  std::vector<size_t> cleared;
  Mesh mesh;
  MapContents contents;
};

/// @return the voxels that were emptied. Regions with a problem are refused.
size_t clearRegion(Mapper& mapper, const Region& region) {
  if (findProblem(region).empty()) return mapper.clearRegion(region).voxels;
  try {
    mapper.clearRegion(region);
  } catch (const std::invalid_argument&) {
    return 0;
  }
  require(false, "a region with a problem is refused");
  return 0;
}

void take(const Step& step, Mapper& mapper, MeshStore& store, Outcome& outcome) {
  if (const auto* const depth = std::get_if<DepthFrame>(&step.what)) {
    outcome.statuses.push_back(mapper.integrate(*depth).status);
  } else if (const auto* const colour = std::get_if<ColourFrame>(&step.what)) {
    outcome.statuses.push_back(mapper.paint(*colour).status);
  } else if (const auto* const region = std::get_if<Region>(&step.what)) {
    outcome.cleared.push_back(clearRegion(mapper, *region));
  } else {
    mapper.clear();
    store.clear();
  }
}

Outcome run(MapperParams params, int threads, const std::vector<Step>& steps) {
  params.threads = threads;
  const auto mapper = makeMapper(params);
  MeshStore store(params.map.voxel_size_m);
  Outcome outcome;
  for (const Step& step : steps) {
    take(step, *mapper, store, outcome);
    store.apply(mapper->updateMesh());
    if (mapper->space() != nullptr) mapper->space()->updateDistances();
    const MapStats stats = mapper->stats();
    require(stats.map_bytes + stats.free_bytes <= size_t(params.map.max_memory_mb) << 20,
            "the budget");
  }
  checkChunks(store);
  outcome.mesh = store.assemble();
  outcome.contents = mapper->contents();
  return outcome;
}

bool sameMeshes(const Mesh& a, const Mesh& b) {
  return sameBytes(a.vertices_m, b.vertices_m) && sameBytes(a.normals, b.normals) &&
         sameBytes(a.triangles, b.triangles) && sameBytes(a.colours, b.colours);
}

bool sameMaps(const MapContents& a, const MapContents& b) {
  const auto same = [](const MapBlock& x, const MapBlock& y) {
    return packedKeyOf(x.key) == packedKeyOf(y.key) && x.directions == y.directions &&
           x.bricks == y.bricks;
  };
  const auto same_free = [](const MapFreeCube& x, const MapFreeCube& y) {
    return packedKeyOf(x.key) == packedKeyOf(y.key) && x.cells == y.cells;
  };
  return std::equal(a.free_cubes.begin(), a.free_cubes.end(), b.free_cubes.begin(),
                    b.free_cubes.end(), same_free) &&
         a.frames == b.frames && a.supporting_frames == b.supporting_frames &&
         a.painted == b.painted && a.exposure == b.exposure &&
         std::equal(a.blocks.begin(), a.blocks.end(), b.blocks.begin(), b.blocks.end(), same) &&
         sameBytes(a.voxels, b.voxels) && sameBytes(a.colours, b.colours);
}

/// The mesh that a mapper makes which goes on from contents.
Mesh meshOf(const MapContents& contents, MapperParams params) {
  params.threads = 1;
  MeshStore store(params.map.voxel_size_m);
  store.apply(makeMapper(params, contents)->updateMesh());
  return store.assemble();
}

void compare(const Outcome& one, const Outcome& two) {
  require(one.statuses == two.statuses, "the same frames are fused");
  require(one.cleared == two.cleared, "the same voxels are cleared");
  require(sameMaps(one.contents, two.contents), "the same map on two threads");
  require(sameMeshes(one.mesh, two.mesh), "the same mesh on two threads");
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  InputBytes bytes(data, size);
  const MapperParams params = takeParams(bytes);
  const bool on_two_threads = bytes.choose(16) == 1;
  std::vector<Step> steps;
  for (int i = 0; i < kSteps && bytes.left() > 0; ++i) steps.push_back(takeStep(bytes));
  const Outcome one = run(params, 1, steps);
  checkMesh(one.mesh);
  checkContents(one.contents);
  require(sameMeshes(one.mesh, meshOf(one.contents, params)), "the same mesh, made anew");
  if (on_two_threads) compare(one, run(params, 2, steps));
  return 0;
}
