/// An analytic scene for evaluating free cells and distances, and its images.
#pragma once

#include "dtsdf_mapping/mapper.h"
#include "evaluation/camera_views.h"
#include "simulation/scene.h"

namespace dtsdf {

/// A scene and the camera poses from which it is viewed.
struct ViewedScene {
  Scene scene;
  Views views;
};

/// A closed room with a ball, a tilted block and a thin tilted plate in it, viewed from all sides.
ViewedScene viewedShapes();

/// Renders and fuses all images of a scene. @throws std::runtime_error if an image is refused.
void fuseScene(const ViewedScene& viewed, Mapper& mapper);

}  // namespace dtsdf
