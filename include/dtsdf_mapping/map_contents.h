/// A whole map outside of a mapper: what a map file holds, and what another mapper resumes from.
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

namespace dtsdf {

/// An array of fixed size whose elements are not set when it is made, so that the threads that fill
/// it are the first to touch it. Can be moved, not copied.
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
  const T* data() const { return data_.get(); }  ///< The same.
  size_t size() const { return size_; }          ///< How many there are.
  T& operator[](size_t i) { return data_[i]; }   ///< One of them.
  /// The same.
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

/// How much a map holds.
struct MapSize {
  size_t blocks = 0;        ///< Blocks of 8 x 8 x 8 voxels.
  size_t voxel_arrays = 0;  ///< Directional arrays of 512 voxels, over all blocks.
  size_t bricks = 0;        ///< Bricks of 64 colours, over all voxel arrays.
  size_t free_cubes = 0;    ///< Cubes of 8 x 8 x 8 cells of space, of which some are free.

  /// What counts towards map/max_memory_mb.
  size_t bytes() const;
};

/// What a mapper does not know of its map.
struct MapOrigin {
  std::string map_frame;  ///< Name of the frame that poses are of; empty: it has none.
  /// Where W, the frame of the map, is another one, since it was levelled: that of poses in it.
  std::optional<Eigen::Isometry3d> T_W_M;
  double stamp_s = 0.0;  ///< Of the newest frame fused, in seconds; 0: not known.
};

/// What there is to know of a map besides what lies where.
struct MapHead : MapOrigin {
  /// The mapper's settings (but for backend, threads, budget and colour of the mesh) and the
  /// numbers of its rules (rules/...).
  ParamTree settings;
  uint64_t frames = 0;             ///< Depth frames that were fused.
  uint64_t supporting_frames = 0;  ///< Those of them that did not only clear.
  bool painted = false;            ///< Whether there ever was colour: meshes have colours then.
  std::array<float, 3> exposure = {1.0f, 1.0f, 1.0f};  ///< Gains of the last colour image.
  int cell_voxels = 0;  ///< Edge of a cell of space, in voxels; 0: there was none to be kept.
};

/// Everything that the map's later bytes depend on. Equal maps have equal contents, whatever the
/// backend, and a mapper that is made from contents continues as the one that they are from would
/// have, byte for byte, with equal settings and below the budget of memory.
struct MapContents : MapHead {
  std::vector<MapBlock> blocks;  ///< By packed key, each once; none without voxels.
  /// 512 words of each voxel array, x fastest: of each block in turn, and of its directions. Bits 0
  /// to 15 are the signed distance in 2^-11 voxels (two's complement), 16 to 31 the anchor, 32 to
  /// 39 the evidence, 40 to 63 the weight in 2^-16.
  PlainArray<uint64_t> voxels;
  /// 64 words of each brick, x fastest: of each block in turn, its directions and bricks (4 x 4 x 4
  /// voxels, x fastest). Bits 0 to 7 are red, then green, blue, and the code of the weight, 0 where
  /// nothing is painted.
  PlainArray<uint32_t> colours;

  std::vector<MapFreeCube> free_cubes;  ///< What was seen free, by packed key, each once.
};

/// What a word of MapContents::voxels holds.
struct VoxelValues {
  float distance_voxels = 0.0f;  ///< Signed distance, in voxels; positive in front of the surface.
  float weight = 0.0f;           ///< Of the average, in frames; 0: no distance is known.
  int evidence = 0;  ///< Frames that supported a surface here, less those that contradicted it.
};

/// Decodes a word of MapContents::voxels.
VoxelValues decodeVoxel(uint64_t word);

/// Counts what contents hold. @throws std::runtime_error for blocks, as below.
MapSize sizeOf(const MapContents& contents);

/// Counts what blocks hold.
/// @throws std::runtime_error for blocks that no map can have: not in the order of their keys, out
/// of the coordinates of a map, without voxels, or with colours where there are no voxels.
MapSize sizeOf(const std::vector<MapBlock>& blocks);

/// Whether contents are such as a mapper gives them. @throws std::runtime_error that says why not.
void checkContents(const MapContents& contents);

/// The settings that a map is bound to, since its voxels mean nothing without them:
/// map/voxel_size_m, map/truncation_voxels, map/directional and fusion/mode.
/// @return `params` with those of the contents.
/// @throws std::runtime_error if one is missing there, or is no such setting.
MapperParams withSettingsOf(const MapContents& contents, MapperParams params);

/// Whether the map is one of this map frame; a name that is empty is not known, and fits.
/// @throws std::runtime_error if it is of another one.
void checkFrame(const MapContents& contents, const std::string& map_frame);

/// Whether a run that levels its map, or one that does not, can resume from the contents; both can
/// from those without frames. @throws std::runtime_error if it does not, with what to do.
void checkLevel(const MapContents& contents, bool is_levelled);

/// The least map/max_memory_mb with which a mapper of these settings can resume from the contents.
int leastMemoryMb(const MapContents& contents, MapperParams params);

/// Bytes that a map may take, in memory and on disk.
size_t mostMapBytes(const MapperParams& params);

/// A remedy for checkFits() where settings were given beside a map.
constexpr char kLeaveSettingOut[] = "leave this setting out: it comes from the file";

/// Whether a mapper of these settings can resume from the contents. With space/enabled it takes
/// over the free cells, which have one size.
/// @throws std::runtime_error with the first of those settings that differs and `remedy`, what the
/// caller can do about that, or where the map is larger than map/max_memory_mb, or for another
/// space/cell_voxels.
void checkFits(const MapContents& contents, const MapperParams& params,
               const std::string& remedy = {});

}  // namespace dtsdf
