/// The scenes, one file each: every function adds the variants of one.
#pragma once

#include "scenes/scene_case.h"

namespace dtsdf {

/// A wall seen from far and then from near in its middle has no slit between the two.
void addNearAfterFarCases(std::vector<SceneCase>& cases);

/// What was taken away is gone, however near and however long it was seen before.
void addRemovedCases(std::vector<SceneCase>& cases);

/// What is put where space was free is there soon.
void addAppearingCases(std::vector<SceneCase>& cases);

/// Slats narrower than two voxels, seen from the front only, are there and no wider than they may.
void addSlatCases(std::vector<SceneCase>& cases);

/// What no frame contradicts stays: out of view, without measurement, thinner than a pixel.
void addUncontradictedCases(std::vector<SceneCase>& cases);

/// Clearing costs no surface where poses are a little wrong.
void addDriftCases(std::vector<SceneCase>& cases);

/// Measurements and poses that are wrong in a single frame leave nothing.
void addStrayCases(std::vector<SceneCase>& cases);

/// Pixels between two surfaces build no bridge, and a real side is no such bridge.
void addMixedPixelCases(std::vector<SceneCase>& cases);

/// Where a surface ends is the mean of what the images saw, neither all of it nor the least.
void addOutlineCases(std::vector<SceneCase>& cases);

/// Where things move about, the map does not grow.
void addMemoryCases(std::vector<SceneCase>& cases);

}  // namespace dtsdf
