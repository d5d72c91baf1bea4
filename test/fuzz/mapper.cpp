// The mapper itself: settings, depth and colour images with their poses, all from bytes. Whatever
// comes, it gives the same bytes on one thread and on two, keeps its budget, and its mesh is valid.
#include "dtsdf_mapping/mapper.h"

#include <limits>
#include <variant>
#include <vector>

#include "fuzz/fuzz_input.h"
#include "fuzz/mesh_check.h"

using namespace dtsdf;

namespace {

constexpr int kFrames = 3;

struct Image {
  std::vector<uint8_t> pixels;
  std::variant<DepthFrame, ColourFrame> frame;
};

/// Mostly what cameras have, sometimes any bits at all.
float takeNumber(InputBytes& bytes, float low, float high) {
  const uint8_t kind = bytes.take<uint8_t>();
  if (kind == 0xff) return bytes.take<float>();
  return low + (high - low) * static_cast<float>(bytes.take<uint16_t>()) / 65535.0f;
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
  params.map.voxel_size_m = takeNumber(bytes, 0.04f, 0.2f);
  if (!(params.map.voxel_size_m >= 0.02f)) params.map.voxel_size_m = 0.02f;
  if (params.map.voxel_size_m > 1.0f) params.map.voxel_size_m = 1.0f;
  params.map.max_memory_mb = 1 + bytes.choose(4);
  params.map.directional = bytes.choose(4) != 0;
  const FusionMode modes[] = {FusionMode::kNormalRayCasting, FusionMode::kRayCasting,
                              FusionMode::kVoxelProjection};
  params.fusion.mode = modes[bytes.choose(3)];
  params.fusion.max_depth_m = 2.0f;
  params.fusion.clearing = bytes.choose(4) != 0;
  params.fusion.normal_radius_px = 1 + bytes.choose(5);
  params.mesh.min_support = 1 + bytes.choose(3);
  params.mesh.refine = bytes.choose(2);
  return params;
}

Image takeImage(InputBytes& bytes) {
  Image image;
  const int width = 1 + bytes.choose(20), height = 1 + bytes.choose(16);
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
    image.frame = frame;
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
  image.frame = frame;
  return image;
}

template <class T>
bool sameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// What a run comes to.
struct Outcome {
  std::vector<FrameStatus> statuses;
  Mesh mesh;
  MapStats stats;
};

Outcome run(MapperParams params, int threads, const std::vector<Image>& images) {
  params.threads = threads;
  const auto mapper = makeMapper(params);
  MeshStore store(params.map.voxel_size_m);
  Outcome outcome;
  for (const Image& image : images) {
    const auto* const depth = std::get_if<DepthFrame>(&image.frame);
    outcome.statuses.push_back(depth != nullptr
                                   ? mapper->integrate(*depth).status
                                   : mapper->paint(std::get<ColourFrame>(image.frame)).status);
    store.apply(mapper->updateMesh());
  }
  outcome.mesh = store.assemble();
  outcome.stats = mapper->stats();
  require(outcome.stats.map_bytes <= size_t(params.map.max_memory_mb) << 20, "the budget");
  return outcome;
}

}  // namespace

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  InputBytes bytes(data, size);
  const MapperParams params = takeParams(bytes);
  std::vector<Image> images;
  for (int i = 0; i < kFrames && bytes.left() > 0; ++i) images.push_back(takeImage(bytes));
  const Outcome one = run(params, 1, images), two = run(params, 2, images);
  checkMesh(one.mesh);
  require(one.statuses == two.statuses, "the same frames are fused");
  require(one.stats.voxel_arrays == two.stats.voxel_arrays, "the same arrays");
  require(sameBytes(one.mesh.vertices_m, two.mesh.vertices_m) &&
              sameBytes(one.mesh.normals, two.mesh.normals) &&
              sameBytes(one.mesh.triangles, two.mesh.triangles) &&
              sameBytes(one.mesh.colours, two.mesh.colours),
          "the same bytes on two threads");
  return 0;
}
