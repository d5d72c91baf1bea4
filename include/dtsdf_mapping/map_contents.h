/// A whole map outside a mapper: the content of a map file, from which a mapper can resume.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "dtsdf_mapping/geometry.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// An array of fixed size whose elements are not initialised, so that the threads that fill it are
/// the first to touch it. Can be moved, not copied.
template <class T>
class PlainArray {
  static_assert(std::is_trivially_copyable<T>::value, "filled as bytes");

 public:
  PlainArray() = default;
  /// Room for so many elements. @throws std::bad_alloc
  explicit PlainArray(size_t size) : data_(size == 0 ? nullptr : new T[size]), size_(size) {}

  /// @name Its elements
  /// @{
  T* data() { return data_.get(); }              ///< The first one.
  const T* data() const { return data_.get(); }  ///< The first one.
  size_t size() const { return size_; }          ///< How many there are.
  T& operator[](size_t i) { return data_[i]; }   ///< One of them.
  /// One of them.
  const T& operator[](size_t i) const { return data_[i]; }
  /// @}

 private:
  std::unique_ptr<T[]> data_;
  size_t size_ = 0;
};

/// A block of the map, and what it holds.
struct MapBlock {
  BlockKey key;         ///< Where it lies.
  uint32_t directions;  ///< Bit d: there are voxels of direction d (X+, X-, Y+, Y-, Z+, Z-).
  uint64_t bricks;      ///< Bit 8 d + b: brick b of direction d has colours.
};

/// A cube of 8 x 8 x 8 cells of space, of which some were seen free.
struct MapFreeCube {
  Vec3i key;                      ///< Its cells are those from 8 * key on.
  std::array<uint64_t, 8> cells;  ///< Word z, bit x + 8 y: that cell of it is free. Some are.
};

/// Size of a map.
struct MapSize {
  size_t blocks = 0;        ///< Blocks of 8 x 8 x 8 voxels.
  size_t voxel_arrays = 0;  ///< Directional arrays of 512 voxels, over all blocks.
  size_t bricks = 0;        ///< Bricks of 64 colours, over all voxel arrays.
  size_t free_cubes = 0;    ///< Cubes of 8 x 8 x 8 cells of space, of which some are free.

  /// Bytes that count towards map/max_memory_mb.
  size_t bytes() const;
};

/// What the caller knows of a map, not the mapper.
struct MapOrigin {
  std::string map_frame;  ///< Name of the frame that poses are of; empty: it has none.
  /// From the frame of poses, M, to that of a levelled map, W; none: the map is not levelled.
  std::optional<Eigen::Isometry3d> T_W_M;
  double stamp_s = 0.0;  ///< Stamp of the newest frame fused, in seconds; 0: not known.
  PoseParams poses;      ///< How the poses of frames were found.
};

/// A map without its blocks, voxels, colours and free cells.
struct MapHead : MapOrigin {
  /// The mapper's settings (except backend, threads, budget and colour of the mesh) and the
  /// numbers of its rules (rules/..., except those of poses). Those of a file include poses/...,
  /// unless poses were taken as given.
  ParamTree settings;
  uint64_t frames = 0;             ///< Depth frames that were fused.
  uint64_t supporting_frames = 0;  ///< Depth frames that did more than clear.
  bool painted = false;            ///< Whether the map was ever painted; meshes then have colours.
  std::array<float, 3> exposure = {1.0f, 1.0f, 1.0f};  ///< Gains of the last colour image.
  int cell_voxels = 0;  ///< Edge of a cell of space, in voxels; 0: without space/enabled.
};

/// Everything that the map's later bytes depend on. Equal maps have equal contents, whatever the
/// backend. A mapper made from contents continues as their mapper would have, byte for byte, given
/// equal settings and enough budget.
struct MapContents : MapHead {
  std::vector<MapBlock> blocks;  ///< Sorted by packed key, each once; none without voxels.
  /// 512 words of each voxel array, x fastest: of each block in turn, and of its directions. Bits 0
  /// to 15 are the signed distance in 2^-11 voxels (two's complement), 16 to 31 the anchor, 32 to
  /// 39 the evidence, 40 to 63 the weight in 2^-16.
  PlainArray<uint64_t> voxels;
  /// 64 words of each brick, x fastest: of each block in turn, its directions and bricks (4 x 4 x 4
  /// voxels, x fastest). Bits 0 to 7 are red, then green, blue, and the code of the weight, 0 where
  /// nothing is painted.
  PlainArray<uint32_t> colours;

  std::vector<MapFreeCube> free_cubes;  ///< Free cells, by packed key, each cube once.
};

/// The values in a word of MapContents::voxels.
struct VoxelValues {
  float distance_voxels = 0.0f;  ///< Signed distance, in voxels; positive in front of the surface.
  float weight = 0.0f;           ///< Weight of the average, in frames; 0: no distance is known.
  int evidence = 0;              ///< Above 0: frames support a surface here; below 0: free space.
};

/// Decodes a word of MapContents::voxels.
VoxelValues decodeVoxel(uint64_t word);

/// The size of contents. @throws std::runtime_error for blocks, as below.
MapSize sizeOf(const MapContents& contents);

/// The size of a map with these blocks.
/// @throws std::runtime_error for blocks that no map can have: not in the order of their keys,
/// beyond the coordinates of a map, without voxels, or with colours where there are no voxels.
MapSize sizeOf(const std::vector<MapBlock>& blocks);

/// Checks that contents are valid. @throws std::runtime_error that says what is wrong.
void checkContents(const MapContents& contents);

/// The settings that a map is bound to, since its voxels mean nothing without them:
/// map/voxel_size_m, map/truncation_voxels, map/directional and fusion/mode.
/// @return `params` with those of the contents.
/// @throws std::runtime_error if one is missing there, or is no such setting.
MapperParams withSettingsOf(const MapContents& contents, MapperParams params);

/// Checks that the map is in this map frame; an empty name matches any.
/// @throws std::runtime_error if it is in another one.
void checkFrame(const MapContents& contents, const std::string& map_frame);

/// Checks that a run that levels its map, or does not, can resume from the contents; either can
/// from contents without frames. @throws std::runtime_error if not, with what to do.
void checkLevel(const MapContents& contents, bool is_levelled);

/// The smallest map/max_memory_mb with which a mapper of these settings can resume from contents.
int leastMemoryMb(const MapContents& contents, MapperParams params);

/// Bytes that a map may take, in memory and on disk.
size_t mostMapBytes(const MapperParams& params);

/// A remedy for checkFits() if settings were given as well as a map.
constexpr char kLeaveSettingOut[] = "leave this setting out: it comes from the file";

/// Checks that a mapper of these settings can resume from the contents. With space/enabled it takes
/// over the free cells, so their size must match.
/// @throws std::runtime_error with the first of the bound settings that differs and `remedy`, which
/// says what to do about it; if the map is larger than map/max_memory_mb; or if space/cell_voxels
/// differs.
void checkFits(const MapContents& contents, const MapperParams& params,
               const std::string& remedy = {});

}  // namespace dtsdf
