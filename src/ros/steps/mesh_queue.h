/// The queue from the map's thread to the output's: what changed in the mesh.
#pragma once

#include <ros/time.h>

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/mesh.h"
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

/// Thread safe. Changes of one block become one, so that an output that stands still costs one mesh
/// of the map and no more; handing over costs what changed, not what there is.
class MeshQueue {
 public:
  /// `on_change` is called after each change, by the thread that made it.
  explicit MeshQueue(std::function<void()> on_change);

  void add(MeshUpdate update, const ros::Time& stamp);
  /// The whole mesh, by packed key, of a map that is another one in part. Whoever follows compares
  /// it with what there was, and takes what differs.
  void replaceAll(const std::map<PackedKey, SharedBlockMesh>& mesh, const ros::Time& stamp);
  /// A new map that takes the place of the old one may have voxels of another size.
  void clear(std::optional<float> voxel_size_m = std::nullopt);

  MeshChanges take();

 private:
  template <class Change>
  void change(const Change& change);

  std::function<void()> on_change_;
  std::mutex mutex_;
  MeshChanges changes_;  ///< Without its blocks.
  std::unordered_map<PackedKey, SharedBlockMesh> blocks_;
};

/// The blocks of a mesh that a store does not have, or has in other bytes; and those that only the
/// store has, without triangles.
std::vector<SharedBlockMesh> differences(const MeshStore& store, std::vector<SharedBlockMesh> mesh);

}  // namespace dtsdf
