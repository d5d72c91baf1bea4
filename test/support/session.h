/// A mapper with the mesh assembled from all its mesh updates.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "mapper/probed_mapper.h"
#include "support/depth_frames.h"

namespace dtsdf {

class Session {
 public:
  explicit Session(const MapperParams& params)
      : mapper_(makeProbedMapper(params)), store_(params.map.voxel_size_m) {}

  void integrate(const SceneFrame& frame) {
    EXPECT_EQ(mapper_->integrate(frame.view()).status, FrameStatus::kFused);
  }
  void updateMesh() { store_.apply(mapper_->updateMesh()); }
  void finishMeshUpdate() { store_.apply(mapper_->finishMeshUpdate()); }
  void clear() {
    mapper_->clear();
    store_.clear();
  }
  ProbedMapper& mapper() { return *mapper_; }
  Mesh mesh() const { return store_.assemble(); }

 private:
  std::unique_ptr<ProbedMapper> mapper_;
  MeshStore store_;
};

}  // namespace dtsdf
