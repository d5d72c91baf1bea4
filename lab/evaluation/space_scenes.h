/// Analytic scenes for the space around surfaces, and the images of them.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "dtsdf_mapping/mapper.h"
#include "evaluation/camera_views.h"
#include "simulation/scene.h"

namespace dtsdf {

/// A scene with the cameras that look at it.
struct ViewedScene {
  Scene scene;
  Views views;
};

/// "shapes": a closed room with a ball, a tilted block and a thin tilted plate in it, seen from all
/// round; "room": the furnished room of the demo, one lap. @throws UsageError for another name.
ViewedScene viewedSceneFromName(const std::string& name);

/// A corridor along x, from -2 to 2 m, closed on all sides, with a plate of so many metres across
/// its middle, seen from both ends. With a `gap` the plate leaves a doorway 0.7 m wide open.
ViewedScene corridorWithPlate(double thickness_m, bool gap);

/// Its inside, and a place at either end of it.
Eigen::AlignedBox3d corridorBounds();
Eigen::Vector3d corridorStart();
Eigen::Vector3d corridorGoal();

/// Fuses all images of a scene. @throws std::runtime_error if one is refused.
void fuseScene(const ViewedScene& viewed, Mapper& mapper);

}  // namespace dtsdf
