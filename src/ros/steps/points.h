/// The step that publishes the vertices of the mesh as a point cloud, while someone listens.
#pragma once

#include <atomic>

#include "dtsdf_mapping/mesh.h"
#include "ros/common/pace.h"
#include "ros/common/topic.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// `surface_points`: a cloud is the whole mesh.
class PointsStep : public Step {
 public:
  explicit PointsStep(const Host& host) : host_(host), pace_(host.rates.points_hz) {}

  void advertise(const Handles& handles) override;
  std::optional<double> meshRate_hz() const override;
  void changed(const MeshChanges&) override { is_outdated_ = true; }
  SteadyDuration publish(ShownMesh* mesh) override;
  void fill(dtsdf_mapping::MapStatus& status) override { status.topics.push_back(topic_.status()); }

 private:
  void publish(const Mesh& mesh, const ros::Time& stamp);

  const Host& host_;
  Topic topic_;
  std::atomic<bool> is_outdated_{false};  ///< The cloud that was published last.
  Pace pace_;
};

}  // namespace dtsdf
