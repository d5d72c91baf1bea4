/// A mapper with what goes with it in a program: its mesh, its frame's name, its newest stamp; and
/// what is handed out of it.
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

/// Threads and GPUs do not survive fork(): what a process made works in that process only. Notes
/// the process that it is made in.
class OneProcess {
 public:
  /// @throws std::runtime_error in a process that was forked from one with such objects.
  explicit OneProcess(const std::string& what) : what_(what), pid_(getpid()) {
    static const pid_t first = getpid();  // made with the first one; a fork inherits it
    if (pid_ != first) {
      throw std::runtime_error("a " + what +
                               " cannot be made in a process that was forked after "
                               "dtsdf_mapping was used: start processes by "
                               "multiprocessing.get_context(\"spawn\")");
    }
  }
  bool isHere() const { return pid_ == getpid(); }
  /// @throws std::runtime_error in another process.
  void check() const {
    if (isHere()) return;
    throw std::runtime_error("this " + what_ +
                             " was made in another process, before fork(): make "
                             "one in this process, started by "
                             "multiprocessing.get_context(\"spawn\")");
  }

 private:
  std::string what_;
  pid_t pid_;
};

/// Every call is for one thread at a time, whoever calls: they wait for each other. Call without
/// the GIL.
class MapperSession {
 public:
  /// An empty map. @throws as makeMapper() does.
  explicit MapperSession(const MapperParams& params);
  /// Continues from contents. @throws as makeMapper() does.
  MapperSession(const MapperParams& params, const MapContents& contents);
  ~MapperSession();

  IntegrationResult integrate(const DepthFrame& frame, double stamp_s);
  std::shared_ptr<const Mesh> mesh(const std::optional<BoxRegion>& region);
  void clear();
  MapContents contents();
  MapInfo save(const std::string& path, const std::optional<std::string>& map_frame);
  /// What `action` does with the mapper, and has of it.
  template <class Action>
  auto withMapper(const Action& action) {
    const auto lock = enter();
    return action(*mapper_);
  }
  /// Meshes what changed, and takes it over into the distances.
  void updateSpace();
  /// Runs `action` with the space. @throws std::runtime_error without space/enabled.
  void withSpace(const std::function<void(Space&)>& action);
  bool hasSpace() const { return params_.space.enabled; }

  const MapperParams& params() const { return params_; }
  const std::optional<Eigen::Isometry3d>& levelPose() const { return origin_.T_W_M; }

 private:
  std::unique_lock<std::mutex> enter();
  void updateMesh() { meshes_.apply(mapper_->updateMesh()); }

  OneProcess process_{"Mapper"};
  std::mutex mutex_;
  MapperParams params_;
  std::unique_ptr<Mapper> mapper_;
  MeshStore meshes_;
  MapOrigin origin_;
};

/// A mapper's space, for Python. Keeps its mapper.
struct SpaceView {
  std::shared_ptr<MapperSession> session;
};

/// A copy of a map, as arrays of voxels. Contents, and which block and direction each array of
/// voxels is of.
struct Blocks {
  Blocks(MapContents map, float voxel_m);

  MapContents contents;
  float voxel_size_m;
  std::vector<uint32_t> block_of;
  std::vector<uint8_t> direction;
};

}  // namespace dtsdf::python
