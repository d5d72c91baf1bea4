/// What is true of the space around surfaces, to hold a map's answers to.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "evaluation/camera_views.h"
#include "evaluation/mesh_scene.h"
#include "simulation/scene.h"

namespace dtsdf {

/// How far it is to surfaces. What nobody saw may be in a map all the same, beside what was seen,
/// so that a distance that it answers should lie between the two.
struct TrueDistance {
  double to_seen_m;  ///< To the nearest surface that some image showed.
  double to_any_m;   ///< To the nearest of all.
};

/// All of it may be asked from several threads at once. Metres, in W.
class SpaceTruth {
 public:
  virtual ~SpaceTruth() = default;

  /// None where it is not known what is seen.
  virtual std::optional<TrueDistance> distanceFrom(const Eigen::Vector3d& p_W) const = 0;

  /// Whether nothing stands between two points.
  virtual bool isClear(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const = 0;

  /// Whether a surface that some image showed, or something solid, reaches into a box.
  virtual bool isTaken(const Eigen::AlignedBox3d& box_W) const = 0;
};

/// A mesh, and the part of it that images showed.
class MeshTruth : public SpaceTruth {
 public:
  MeshTruth(const TriangleMesh& all, const TriangleMesh& seen) : all_(all), seen_(seen) {}

  std::optional<TrueDistance> distanceFrom(const Eigen::Vector3d& p_W) const override;
  bool isClear(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const override;
  bool isTaken(const Eigen::AlignedBox3d& box_W) const override;

 private:
  MeshScene all_, seen_;
};

/// Shapes whose distances are known exactly. They count as seen where the nearest point of them
/// is in the middle of some image with nothing in front of it; nothing is known where it is not.
class SceneTruth : public SpaceTruth {
 public:
  SceneTruth(const Scene& scene, const Views& views) : scene_(scene), views_(views) {}

  std::optional<TrueDistance> distanceFrom(const Eigen::Vector3d& p_W) const override;
  bool isClear(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const override;
  bool isTaken(const Eigen::AlignedBox3d& box_W) const override;

 private:
  bool isSeen(const Eigen::Vector3d& p_W) const;

  const Scene scene_;
  const Views views_;
};

/// Whether a point lies in an image, so far inside its rim.
bool isInImage(const ViewCamera& camera, const Eigen::Vector3d& p_C, double rim_px = 0.0);

/// Whether some view looks through all of a box, to its far end and no farther than `max_range_m`:
/// judged by a grid of points in it, the corners among them.
bool isSeenThrough(const SpaceTruth& truth, const Views& views, const Eigen::AlignedBox3d& box_W,
                   double max_range_m);

}  // namespace dtsdf
