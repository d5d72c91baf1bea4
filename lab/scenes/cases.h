/// The scenes, each in its own file. Each function adds the variants of one scene.
#pragma once

#include "scenes/scene_case.h"

namespace dtsdf {

/// A wall has no gap between the part seen only from far away and the part also seen from nearby.
void addNearAfterFarCases(std::vector<SceneCase>& cases);

/// A removed object vanishes, however near and however long it was seen before.
void addRemovedCases(std::vector<SceneCase>& cases);

/// An object placed in free space soon appears.
void addAppearingCases(std::vector<SceneCase>& cases);

/// Thin slats, seen from the front only, are complete and not too wide; gaps between them stay
/// open.
void addSlatCases(std::vector<SceneCase>& cases);

/// Surfaces that no frame contradicts stay: out of view, not measured, or thinner than a pixel.
void addUncontradictedCases(std::vector<SceneCase>& cases);

/// Clearing removes no surface if poses are slightly wrong.
void addDriftCases(std::vector<SceneCase>& cases);

/// Wrong depths or a wrong pose in single frames leave no surface. With mesh/min_support 1, a
/// corner seen in a single frame is kept.
void addStrayCases(std::vector<SceneCase>& cases);

/// Mixed pixels between two surfaces build no bridge, and a real side is not removed as a bridge.
void addMixedPixelCases(std::vector<SceneCase>& cases);

/// A surface ends at the mean of the outlines in the images, not at the widest or the narrowest.
void addOutlineCases(std::vector<SceneCase>& cases);

/// The map does not grow while a box moves around.
void addMemoryCases(std::vector<SceneCase>& cases);

}  // namespace dtsdf
