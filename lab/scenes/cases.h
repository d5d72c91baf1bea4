/// Functions that add the variants of each scene. Every scene is defined in its own file.
#pragma once

#include "scenes/scene_case.h"

namespace dtsdf {

/// A wall is first viewed from far away, then in part from nearby. No gap may remain between the
/// two parts.
void addNearAfterFarCases(std::vector<SceneCase>& cases);

/// A removed object must vanish, no matter how near to the camera and for how long it was observed
/// before.
void addRemovedCases(std::vector<SceneCase>& cases);

/// An object that is placed where the map was free must soon appear.
void addAppearingCases(std::vector<SceneCase>& cases);

/// Thin slats, viewed only from the front, must be complete and not too wide, and the gaps between
/// them must stay open.
void addSlatCases(std::vector<SceneCase>& cases);

/// Surfaces that no frame contradicts must stay, whether they are out of view, not measured, or
/// thinner than a pixel.
void addUncontradictedCases(std::vector<SceneCase>& cases);

/// Clearing must not remove surfaces if poses are slightly wrong.
void addDriftCases(std::vector<SceneCase>& cases);

/// Wrong depths or a wrong pose in single frames must leave no surface. With mesh/min_support 1, a
/// corner that is visible in a single frame must be kept.
void addStrayCases(std::vector<SceneCase>& cases);

/// Mixed pixels between two surfaces must not form a bridge, but a real surface in its place must
/// be kept.
void addMixedPixelCases(std::vector<SceneCase>& cases);

/// A surface must end at the mean of its outlines in the images, not at the widest or narrowest
/// outline.
void addOutlineCases(std::vector<SceneCase>& cases);

/// The map must not grow while a box moves around.
void addMemoryCases(std::vector<SceneCase>& cases);

}  // namespace dtsdf
