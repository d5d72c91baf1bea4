/// A mapper with its mesh, the name of its frame and its newest stamp; and the objects that Python
/// gets from it.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/map_contents.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"

namespace dtsdf::python {

/// Remembers the process in which a mapper is made. Threads and GPUs do not survive fork(), so the
/// mapper works in that process only.
class OneProcess {
 public:
  /// @throws std::runtime_error in a process that was forked from one with a mapper.
  OneProcess() {
    static const pid_t first = getpid();  // set by the first object; a fork inherits it
    if (pid_ == first) return;
    throw std::runtime_error(
        "a Mapper cannot be made in a process that was forked after dtsdf_mapping was used: start "
        "processes with multiprocessing.get_context(\"spawn\")");
  }
  bool isHere() const { return pid_ == getpid(); }
  /// @throws std::runtime_error in another process.
  void check() const {
    if (isHere()) return;
    throw std::runtime_error(
        "this Mapper was made in another process, before fork(): make one in this process, started "
        "with multiprocessing.get_context(\"spawn\")");
  }

 private:
  const pid_t pid_ = getpid();
};

/// Thread safe: calls wait for each other. Call without the GIL.
class MapperSession {
 public:
  /// Begins with an empty map. @throws as makeMapper() does.
  explicit MapperSession(const MapperParams& params);
  /// Continues from contents. @throws as makeMapper() does.
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
  /// Runs `action` with the space. @throws std::runtime_error without space/enabled.
  void withSpace(const std::function<void(Space&)>& action);
  bool hasSpace() const { return params_.space.enabled; }

  const MapperParams& params() const { return params_; }
  const std::optional<Eigen::Isometry3d>& levelPose() const { return origin_.T_W_M; }

 private:
  std::unique_lock<std::mutex> enter();
  void updateMesh() { meshes_.apply(mapper_->updateMesh()); }

  OneProcess process_;
  std::mutex mutex_;
  MapperParams params_;
  std::unique_ptr<Mapper> mapper_;
  MeshStore meshes_;
  MapOrigin origin_;
};

/// A mapper's space, for Python. Keeps the mapper alive.
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
