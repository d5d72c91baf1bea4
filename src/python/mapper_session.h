/// A mapper with what goes with it in a program: its mesh, its frame's name, its newest stamp.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/mesh.h"
#include "python/one_process.h"

namespace dtsdf::python {

/// Every call is for one thread at a time, whoever calls: they wait for each other. Call without
/// the GIL.
class MapperSession {
 public:
  /// An empty map. @throws as makeMapper() does.
  explicit MapperSession(const MapperParams& params);
  /// Continues from contents, which it empties. @throws as makeMapper() does.
  MapperSession(const MapperParams& params, MapContents contents);
  ~MapperSession();

  IntegrationResult integrate(const DepthFrame& frame, double stamp_s);
  IntegrationResult paint(const ColourFrame& frame);
  RenderedView render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C);
  std::shared_ptr<const Mesh> mesh(const std::optional<BoxRegion>& region);
  ClearedRegion clearRegion(const Region& region);
  void clear();
  MapContents contents();
  SavedMap save(const std::string& path, const std::optional<std::string>& map_frame);
  MapStats stats();
  MapperMemory memory();
  std::string backendName();
  /// Meshes what changed, and takes it over into the distances.
  void updateSpace();
  /// Runs `action` with the space. @throws std::runtime_error without space/enabled.
  void withSpace(const std::function<void(Space&)>& action);
  bool hasSpace() const { return params_.space.enabled; }

  const MapperParams& params() const { return params_; }
  const std::optional<Eigen::Isometry3d>& levelPose() const { return T_W_M_; }

 private:
  std::unique_lock<std::mutex> enter();
  void updateMesh() { meshes_.apply(mapper_->updateMesh()); }

  OneProcess process_{"Mapper"};
  std::mutex mutex_;
  MapperParams params_;
  std::unique_ptr<Mapper> mapper_;
  MeshStore meshes_;
  std::string map_frame_;
  std::optional<Eigen::Isometry3d> T_W_M_;
  double stamp_s_ = 0.0;
};

}  // namespace dtsdf::python
