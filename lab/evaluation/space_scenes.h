/// Analytic scenes for measuring free space and distances, and images of these scenes.
#pragma once

#include "dtsdf_mapping/mapper.h"
#include "evaluation/camera_views.h"
#include "simulation/scene.h"

namespace dtsdf {

/// A scene and the cameras that view it.
struct ViewedScene {
  Scene scene;
  Views views;
};

/// A closed room with a ball, a tilted block and a thin tilted plate in it, seen from all sides.
ViewedScene viewedShapes();

/// Fuses all images of a scene. @throws std::runtime_error if an image is refused.
void fuseScene(const ViewedScene& viewed, Mapper& mapper);

}  // namespace dtsdf
