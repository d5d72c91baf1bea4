/// The objects behind the Python classes for a mapper, its free-space grid and its blocks.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/map_contents.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"

namespace dtsdf::python {

/// Thread-safe: concurrent calls are serialised. Call without holding the GIL. Threads and GPUs do
/// not survive fork(): in a process that was forked after the first session was created, every call
/// throws except the destructor, params() and levelPose().
class MapperSession {
 public:
  /// Begins with an empty map. @throws as makeMapper() does.
  explicit MapperSession(const MapperParams& params);
  /// Continues from the contents of a map. @throws as makeMapper() does.
  MapperSession(const MapperParams& params, const MapContents& contents);
  ~MapperSession();

  IntegrationResult integrate(const DepthFrame& frame, double stamp_s);
  std::shared_ptr<const Mesh> mesh(const std::optional<BoxRegion>& region);
  void clear();
  MapContents contents();
  MapInfo save(const std::string& path, const std::optional<std::string>& map_frame);
  /// Calls `action` with the mapper and returns its result.
  template <class Action>
  auto withMapper(const Action& action) {
    const auto lock = enter();
    return action(*mapper_);
  }
  /// Updates the mesh and then the distances.
  void updateSpace();
  /// Runs `action` with the free-space grid. @throws std::runtime_error without space/enabled.
  void withSpace(const std::function<void(Space&)>& action);

  const MapperParams& params() const { return params_; }
  const std::optional<Eigen::Isometry3d>& levelPose() const { return origin_.T_W_M; }

 private:
  std::unique_lock<std::mutex> enter();
  void updateMesh() { meshes_.apply(mapper_->updateMesh()); }

  std::mutex mutex_;
  MapperParams params_;
  std::unique_ptr<Mapper> mapper_;
  MeshStore meshes_;
  MapOrigin origin_;
};

/// A mapper's free-space grid, for Python. Keeps the mapper alive.
struct SpaceView {
  std::shared_ptr<MapperSession> session;
};

/// A copy of a map, with the block and direction of each voxel array.
struct Blocks {
  Blocks(MapContents map, float voxel_m);

  MapContents contents;
  float voxel_size_m;
  std::vector<uint32_t> block_of;
  std::vector<uint8_t> direction;
};

}  // namespace dtsdf::python
