#include "support/saved_maps.h"

#include <algorithm>

#include "map/map_head.h"
#include "support/same_bytes.h"

namespace dtsdf {
namespace {

constexpr int kFrames = 16, kFramesWithBox = 7;

Scene scene(int frame) {
  Scene scene;
  scene.add(Room{Eigen::Vector3d(-1.2, -1.2, -0.9), Eigen::Vector3d(1.2, 1.2, 0.9)});
  if (frame < kFramesWithBox) scene.add(makeBox({0.2, 0.1, -0.2}, {0.3, 0.3, 0.5}, 0.4));
  return scene;
}

/// Makes each image darker than the previous one, so that continuing a map requires the exposure
/// gains of its last image.
void darken(PaintedFrame& image, int frame) {
  for (uint8_t& value : image.pixels) {
    value = static_cast<uint8_t>(value - value * frame / 40);
  }
}

template <class T>
PlainArray<T> copyOf(const PlainArray<T>& array) {
  PlainArray<T> copy(array.size());
  std::copy_n(array.data(), array.size(), copy.data());
  return copy;
}

}  // namespace

Colour stripes(const Eigen::Vector3d& p_W) {
  const auto band = [](double x_m) {
    return static_cast<uint8_t>(60 + 30 * (static_cast<int>(x_m * 10.0 + 100.0) % 5));
  };
  return {band(p_W.x()), band(p_W.y()), band(p_W.z())};
}

const RoomRecording& roomRecording() {
  static const RoomRecording recording = [] {
    RoomRecording made;
    for (int i = 0; i < kFrames; ++i) {
      const double angle = 0.35 * i;
      const Eigen::Vector3d eye(0.8 * std::cos(angle), 0.8 * std::sin(angle), 0.05 * (i % 4));
      const Eigen::Isometry3d T_W_C =
          lookAt(eye, Eigen::Vector3d(0.1, 0.0, -0.2), Eigen::Vector3d::UnitZ());
      made.depth.push_back(renderFrame(scene(i), T_W_C, 120, 90));
      made.colour.push_back(renderColour(scene(i), stripes, besideCamera(T_W_C, 0.03), 120, 90));
      darken(made.colour.back(), i);
    }
    return made;
  }();
  return recording;
}

void feed(Mapper& mapper, size_t first, size_t last, bool painted) {
  for (size_t i = first; i < last; ++i) {
    EXPECT_EQ(mapper.integrate(roomRecording().depth[i].view()).status, FrameStatus::kFused);
    if (painted) mapper.paint(roomRecording().colour[i].view());
  }
}

MapContents roomContents(bool painted, const MapperParams& params) {
  const auto mapper = makeMapper(params);
  feed(*mapper, 0, roomRecording().depth.size(), painted);
  return mapper->contents();
}

Mesh meshOf(Mapper& mapper, float voxel_size_m) {
  MeshStore store(voxel_size_m);
  store.apply(mapper.updateMesh());
  return store.assemble();
}

MapContents copyOf(const MapContents& contents) {
  MapContents copy = headOf(contents);
  copy.blocks = contents.blocks;
  copy.voxels = copyOf(contents.voxels);
  copy.colours = copyOf(contents.colours);
  copy.cell_voxels = contents.cell_voxels;
  copy.free_cubes = contents.free_cubes;
  return copy;
}

testing::AssertionResult sameContents(const MapContents& a, const MapContents& b) {
  const auto differ = [](const char* what) {
    return testing::AssertionFailure() << what << " differ";
  };
  if (a.settings != b.settings) return differ("settings");
  if (a.map_frame != b.map_frame) return differ("names of the map frame");
  if (!haveSameLevel(a, b)) return differ("levelling transforms");
  if (a.stamp_s != b.stamp_s) return differ("stamps");
  if (a.frames != b.frames || a.supporting_frames != b.supporting_frames) return differ("frames");
  if (a.painted != b.painted || a.exposure != b.exposure) return differ("painting or exposure");
  const bool same_blocks = std::equal(a.blocks.begin(), a.blocks.end(), b.blocks.begin(),
                                      b.blocks.end(), [](const MapBlock& x, const MapBlock& y) {
                                        return x.key.x == y.key.x && x.key.y == y.key.y &&
                                               x.key.z == y.key.z && x.directions == y.directions &&
                                               x.bricks == y.bricks;
                                      });
  if (!same_blocks) return differ("blocks");
  if (!sameBytes(a.voxels, b.voxels)) return differ("voxels");
  if (!sameBytes(a.colours, b.colours)) return differ("colours");
  const bool same_free =
      a.cell_voxels == b.cell_voxels &&
      std::equal(a.free_cubes.begin(), a.free_cubes.end(), b.free_cubes.begin(), b.free_cubes.end(),
                 [](const MapFreeCube& x, const MapFreeCube& y) {
                   return x.key.x == y.key.x && x.key.y == y.key.y && x.key.z == y.key.z &&
                          x.cells == y.cells;
                 });
  if (!same_free) return differ("free cells");
  return testing::AssertionSuccess();
}

}  // namespace dtsdf
