#include "dtsdf_mapping/map_contents.h"
#include "python/mapper_session.h"
#include "python/module.h"
#include "python/values.h"

namespace dtsdf::python {
namespace {

constexpr int kSide = kBlockSide;

/// An array of shape (A, 8, 8, 8) with one value per voxel of the A voxel arrays, decoded without
/// holding the GIL.
template <class T, class Get>
py::array decoded(const Blocks& blocks, const Get& get) {
  std::vector<T> values;
  {
    const py::gil_scoped_release release;
    const PlainArray<uint64_t>& words = blocks.contents.voxels;
    values.reserve(words.size());
    for (size_t i = 0; i < words.size(); ++i) values.push_back(get(decodeVoxel(words[i])));
  }
  const auto arrays = static_cast<py::ssize_t>(blocks.block_of.size());
  return takeOver(std::move(values), {arrays, kSide, kSide, kSide});
}

py::array keysOf(const Blocks& blocks) {
  std::vector<int32_t> keys;
  for (const MapBlock& block : blocks.contents.blocks) {
    keys.insert(keys.end(), {block.key.x, block.key.y, block.key.z});
  }
  const auto count = static_cast<py::ssize_t>(blocks.contents.blocks.size());
  return takeOver(std::move(keys), {count, 3});
}

py::array wordsOf(const py::object& self) {
  const auto& blocks = self.cast<const Blocks&>();
  const auto arrays = static_cast<py::ssize_t>(blocks.block_of.size());
  return viewOf(blocks.contents.voxels.data(), {arrays, kSide, kSide, kSide}, self);
}

py::array blockOf(const py::object& self) {
  const auto& blocks = self.cast<const Blocks&>();
  return viewOf(blocks.block_of.data(), {static_cast<py::ssize_t>(blocks.block_of.size())}, self);
}

py::array directionOf(const py::object& self) {
  const auto& blocks = self.cast<const Blocks&>();
  return viewOf(blocks.direction.data(), {static_cast<py::ssize_t>(blocks.direction.size())}, self);
}

}  // namespace

Blocks::Blocks(MapContents map, float voxel_m) : contents(std::move(map)), voxel_size_m(voxel_m) {
  constexpr int kDirections = 6;
  for (size_t i = 0; i < contents.blocks.size(); ++i) {
    for (int d = 0; d < kDirections; ++d) {
      if ((contents.blocks[i].directions >> d & 1) == 0) continue;
      block_of.push_back(static_cast<uint32_t>(i));
      direction.push_back(static_cast<uint8_t>(d));
    }
  }
}

void bindBlocks(py::module& m) {
  py::class_<Blocks> blocks(m, "Blocks",
                            "A copy of a map's voxels: B blocks, and A arrays of 8 x 8 x 8 voxels, "
                            "one for each\n"
                            "direction in a block. Index voxels as [array, z, y, x]; voxel "
                            "(x, y, z) of a block\n"
                            "lies at (8 * key + (x, y, z)) * voxel_size_m in W.");
  blocks.def_readonly("voxel_size_m", &Blocks::voxel_size_m, "Edge of a voxel, in metres.")
      .def_property_readonly("keys", &keysOf, "(B, 3) int32: coordinates of the blocks, in blocks.")
      .def_property_readonly("block_of", &blockOf,
                             "(A,) uint32: for each array, the index of its block in keys.")
      .def_property_readonly(
          "direction", &directionOf,
          "(A,) uint8: 0 to 5 for X+, X-, Y+, Y-, Z+, Z-; 0 in an ordinary TSDF.")
      .def_property_readonly("words", &wordsOf,
                             "(A, 8, 8, 8) uint64: voxels as stored in map files, not copied.")
      .def_property_readonly(
          "distance_m",
          [](const Blocks& self) {
            return decoded<float>(
                self, [&](const VoxelValues& v) { return v.distance_voxels * self.voxel_size_m; });
          },
          "(A, 8, 8, 8) float32: signed distance in metres, positive in front of\n"
          "the surface; undefined where weight is 0. Decoded on each call.")
      .def_property_readonly(
          "weight",
          [](const Blocks& self) {
            return decoded<float>(self, [](const VoxelValues& v) { return v.weight; });
          },
          "(A, 8, 8, 8) float32: weight of the distance, in frames; 0 if there is none.")
      .def_property_readonly(
          "evidence",
          [](const Blocks& self) {
            return decoded<int8_t>(
                self, [](const VoxelValues& v) { return static_cast<int8_t>(v.evidence); });
          },
          "(A, 8, 8, 8) int8: above 0 for a surface (+3 per supporting frame, -2 per\n"
          "contradicting one), below 0 for free space.");
  refusePickle(blocks, "Blocks", "pickle its arrays");
}

}  // namespace dtsdf::python
