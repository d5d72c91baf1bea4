/// Analytic scenes for the space around surfaces, and their images.
#pragma once

#include "dtsdf_mapping/mapper.h"
#include "evaluation/camera_views.h"
#include "simulation/scene.h"

namespace dtsdf {

/// A scene with the cameras that look at it.
struct ViewedScene {
  Scene scene;
  Views views;
};

/// A closed room with a ball, a tilted block and a thin tilted plate in it, seen from all sides.
ViewedScene viewedShapes();

/// Fuses all images of a scene. @throws std::runtime_error if one is refused.
void fuseScene(const ViewedScene& viewed, Mapper& mapper);

}  // namespace dtsdf
