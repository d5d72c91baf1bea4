/// A copy of a whole map, as stored in a map file. A mapper can resume from it.
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

/// An array of fixed size whose elements are not initialised, so that its memory is first touched
/// by the threads that fill it. Can be moved but not copied.
template <class T>
class PlainArray {
  static_assert(std::is_trivially_copyable<T>::value, "elements must be trivially copyable");

 public:
  PlainArray() = default;
  /// Allocates `size` elements. @throws std::bad_alloc
  explicit PlainArray(size_t size) : data_(size == 0 ? nullptr : new T[size]), size_(size) {}

  /// @name Elements
  /// @{
  T* data() { return data_.get(); }              ///< First element.
  const T* data() const { return data_.get(); }  ///< First element.
  size_t size() const { return size_; }          ///< Number of elements.
  T& operator[](size_t i) { return data_[i]; }   ///< Element i.
  /// Element i.
  const T& operator[](size_t i) const { return data_[i]; }
  /// @}

 private:
  std::unique_ptr<T[]> data_;
  size_t size_ = 0;
};

/// A block of the map: which voxel arrays and which colour bricks (of 4 x 4 x 4 voxels) it has.
struct MapBlock {
  BlockKey key;         ///< Position of the block.
  uint32_t directions;  ///< Bit d: the block has voxels in direction d (X+, X-, Y+, Y-, Z+, Z-).
  uint64_t bricks;      ///< Bit 8 d + b: brick b of direction d has colours.
};

/// A cube of 8 x 8 x 8 cells of the free-space grid, at least one of which is free.
struct MapFreeCube {
  Vec3i key;                      ///< The cube's first cell is 8 * key.
  std::array<uint64_t, 8> cells;  ///< Bit x + 8 y of word z: cell (x, y, z) is free. Not all 0.
};

/// Size of a map.
struct MapSize {
  size_t blocks = 0;        ///< Blocks of 8 x 8 x 8 voxels.
  size_t voxel_arrays = 0;  ///< Voxel arrays of 512 voxels, over all blocks.
  size_t bricks = 0;        ///< Bricks of 64 colours, over all voxel arrays.
  /// Cubes of 8 x 8 x 8 cells of the free-space grid that contain free cells.
  size_t free_cubes = 0;

  /// Bytes that count towards map/max_memory_mb.
  size_t bytes() const;
};

/// Information about a map, supplied by its user. The mapper itself does not use it.
struct MapOrigin {
  std::string map_frame;  ///< Name of the frame in which poses are given; empty: unnamed.
  /// Levelling transform, from the frame M of the poses to the map frame W; not set if the map is
  /// not levelled.
  std::optional<Eigen::Isometry3d> T_W_M;
  double stamp_s = 0.0;  ///< Stamp of the newest frame fused, in seconds; 0: not known.
  PoseParams poses;      ///< Settings with which the poses of the frames were found.
};

/// Description of a map, without its blocks, voxels, colours and free cells.
struct MapHead : MapOrigin {
  /// The settings of the mapper (except backend, threads, memory budget, paging and mesh colour)
  /// and its rule parameters (rules/..., except rules/poses/...). In a file, these include
  /// poses/..., unless poses were used as supplied.
  ParamTree settings;
  uint64_t frames = 0;             ///< Depth frames fused.
  uint64_t supporting_frames = 0;  ///< Depth frames that were not used only to clear space.
  bool painted = false;            ///< Whether the map was ever painted; meshes then have colours.
  std::array<float, 3> exposure = {1.0f, 1.0f, 1.0f};  ///< Gains of the last colour image.
  int cell_voxels = 0;  ///< Edge of a free-space cell, in voxels; 0 if space/enabled is false.
};

/// The complete state of a map. Equal maps have equal contents on every backend. A mapper created
/// from the contents continues exactly as the original mapper would have, given equal settings and
/// a sufficient memory budget.
struct MapContents : MapHead {
  std::vector<MapBlock> blocks;  ///< Sorted by packed key, without duplicates; each has voxels.
  /// 512 words per voxel array, x fastest, in the order of blocks, then of directions. Bits 0 to 15
  /// are the signed distance in units of 2^-11 voxels (two's complement), 16 to 31 the anchor
  /// (docs/map_format.md), 32 to 39 the evidence, 40 to 63 the weight in units of 2^-16.
  PlainArray<uint64_t> voxels;
  /// 64 words per brick of 4 x 4 x 4 voxels, x fastest, in the order of blocks, directions and
  /// bricks. Bits 0 to 7 are red, 8 to 15 green, 16 to 23 blue, 24 to 31 the encoded weight. A word
  /// is 0 where nothing is painted.
  PlainArray<uint32_t> colours;

  std::vector<MapFreeCube> free_cubes;  ///< Sorted by packed key, without duplicates.
};

/// The values encoded in a word of MapContents::voxels.
struct VoxelValues {
  float distance_voxels = 0.0f;  ///< Signed distance, in voxels; positive in front of the surface.
  float weight = 0.0f;           ///< Weight of the average, in frames; 0: no distance is known.
  int evidence = 0;              ///< Above 0: frames support a surface here; below 0: free space.
};

/// Decodes a word of MapContents::voxels.
VoxelValues decodeVoxel(uint64_t word);

/// Size of a map. @throws std::runtime_error for invalid blocks, as sizeOf(blocks) does.
MapSize sizeOf(const MapContents& contents);

/// Size of a map with these blocks.
/// @throws std::runtime_error for invalid blocks: not sorted by key, outside the coordinate range
/// of a map, without directions or with invalid directions, or with colours where there are no
/// voxels.
MapSize sizeOf(const std::vector<MapBlock>& blocks);

/// Checks that the contents are valid. @throws std::runtime_error that says what is wrong.
void checkContents(const MapContents& contents);

/// Copies the settings that must match those of the map into `params`: map/voxel_size_m,
/// map/truncation_voxels, map/directional and fusion/mode.
/// @return `params` with these settings from the contents.
/// @throws std::runtime_error if one of these settings is missing or invalid in the contents.
MapperParams withSettingsOf(const MapContents& contents, MapperParams params);

/// Checks that the map is in the frame `map_frame`. An empty name, here or in the map, matches any
/// frame.
/// @throws std::runtime_error if the map is in another frame.
void checkFrame(const MapContents& contents, const std::string& map_frame);

/// Checks that a run can resume from the contents: both must be levelled, or neither. Any run can
/// resume from contents without frames. @throws std::runtime_error if the run cannot resume; the
/// message says what to do.
void checkLevel(const MapContents& contents, bool is_levelled);

/// A value of map/max_memory_mb that is sufficient for a mapper with these settings to resume from
/// the contents. With map/page_folder, a smaller value may do.
int minMemoryMb(const MapContents& contents, MapperParams params);

/// Limit that loadMap() applies, in bytes: the memory budget plus, with map/page_folder, the
/// maximum size of a page file.
size_t maxMapBytes(const MapperParams& params);

/// Remedy to pass to checkFits() if the user specified settings together with a map.
constexpr char kLeaveSettingOut[] = "leave this setting out: it comes from the file";

/// Checks that a mapper with these settings can resume from the contents. With space/enabled, the
/// cell size must match too, if the contents include free cells.
/// @throws std::runtime_error if a setting of withSettingsOf() differs (the message names the first
/// such setting and ends with `remedy`), if space/cell_voxels differs, or if the map exceeds the
/// memory budget and, with map/page_folder, the limit on disk.
void checkFits(const MapContents& contents, const MapperParams& params,
               const std::string& remedy = {});

}  // namespace dtsdf
