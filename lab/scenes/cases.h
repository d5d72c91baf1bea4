/// The scenes, one file each; each function adds the variants of one scene.
#pragma once

#include "scenes/scene_case.h"

namespace dtsdf {

/// A wall seen from far away, and then its middle from close by, has no gap between the two parts.
void addNearAfterFarCases(std::vector<SceneCase>& cases);

/// A removed object is gone, however close and however long it was seen before.
void addRemovedCases(std::vector<SceneCase>& cases);

/// An object that is put into free space appears soon.
void addAppearingCases(std::vector<SceneCase>& cases);

/// Slats narrower than two voxels, seen from the front only, are there and not too wide.
void addSlatCases(std::vector<SceneCase>& cases);

/// Surfaces that no frame contradicts stay: out of view, not measured, or thinner than a pixel.
void addUncontradictedCases(std::vector<SceneCase>& cases);

/// Clearing removes no surface if poses are slightly wrong.
void addDriftCases(std::vector<SceneCase>& cases);

/// Wrong measurements or poses in a single frame leave no trace.
void addStrayCases(std::vector<SceneCase>& cases);

/// Mixed pixels between two surfaces build no bridge, and a real side is not removed as a bridge.
void addMixedPixelCases(std::vector<SceneCase>& cases);

/// A surface ends at the mean of the outlines in the images, not at the widest or the narrowest.
void addOutlineCases(std::vector<SceneCase>& cases);

/// The map does not grow while objects move around.
void addMemoryCases(std::vector<SceneCase>& cases);

}  // namespace dtsdf
