/// The queues from the map's thread to the outputs: what changed in the mesh, and what has become
/// known of space.
#pragma once

#include <ros/time.h>

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "dtsdf_mapping/space.h"
#include "kernels/core/grid.h"

namespace dtsdf {

/// What has happened to the mesh since it was last asked for, in the order of its members.
struct MeshChanges {
  bool cleared = false;                 ///< First, the whole mesh was forgotten.
  bool is_whole = false;                ///< Or: what is not in `blocks` was.
  std::optional<float> voxel_size_m;    ///< Of the map from there on, if it is a new one.
  std::vector<SharedBlockMesh> blocks;  ///< Then these were replaced, in no order.
  ros::Time stamp;                      ///< Of the newest frame in them; zero if there are none.
};

/// The queue from the map's thread to the output's: what changed in the mesh. Thread safe. Changes
/// of one block become one, so that an output that stands still costs one mesh of the map and no
/// more; handing over costs what changed, not what there is.
class MeshHandover {
 public:
  /// `on_change` is called after each change, by the thread that made it.
  explicit MeshHandover(std::function<void()> on_change);

  void add(MeshUpdate update, const ros::Time& stamp);
  /// The whole mesh, by packed key, of a map that is another one in part. Whoever follows compares
  /// it with what there was, and takes what differs.
  void replaceAll(std::map<PackedKey, BlockMesh> mesh, const ros::Time& stamp);
  /// A new map that takes the place of the old one may have voxels of another size.
  void clear(std::optional<float> voxel_size_m = std::nullopt);

  MeshChanges take();

 private:
  std::function<void()> on_change_;
  std::mutex mutex_;
  MeshChanges changes_;  ///< Without its blocks.
  std::unordered_map<PackedKey, SharedBlockMesh> blocks_;
};

/// What a store lacks to be a mesh: of the blocks that it holds, or has in other bytes, `mesh` has
/// the newer ones; those that `mesh` has not are without triangles.
std::vector<SharedBlockMesh> differences(const MeshStore& store, std::vector<SharedBlockMesh> mesh);

/// What has become known since it was last taken.
struct SpaceDelivery {
  SpaceChanges changes;
  double cell_size_m = 0.0;
  /// Of the newest frame whose surfaces are in it; cells may be free by later ones. 0: none was
  /// fused, as in a map that was loaded.
  ros::Time stamp;
};

/// What leads from what was known before to what is known now: all cubes of which something is.
SpaceChanges changesBetween(const KnownSpace& before, const std::vector<SpaceCube>& now);

/// The queue from the map's thread to that of space: what has become known. Thread safe. Changes of
/// one cube become one, so that an output that stands still costs the cells of the map once and no
/// more.
class SpaceHandover {
 public:
  /// `on_change` is called after each change, by the thread that made it.
  explicit SpaceHandover(std::function<void()> on_change) : on_change_(std::move(on_change)) {}

  void add(const SpaceChanges& changes, double cell_size_m, const ros::Time& stamp);

  /// Whether so much waits that more is better handed over later.
  bool isFull() const;

  /// The map has become another one, or empty: drops what waits, and has the output forget all.
  void clear();

  /// Nothing, if nothing has changed.
  std::optional<SpaceDelivery> take();

 private:
  std::function<void()> on_change_;
  mutable std::mutex mutex_;
  bool has_changes_ = false, begins_anew_ = false;
  std::unordered_map<PackedKey, SpaceCube> cubes_;
  double cell_size_m_ = 0.0;
  ros::Time stamp_;
};

}  // namespace dtsdf
