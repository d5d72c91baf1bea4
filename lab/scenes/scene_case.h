/// Settings, cases and measurements for testing that maps of analytic scenes contain the observed
/// surfaces, and nothing else.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Settings for the maps of a case.
struct SceneSetup {
  MapperParams params;
  Rules rules;
  int image_width = 320;  ///< Width of the room camera's images; its focal length is fixed.

  double voxel() const { return static_cast<double>(params.map.voxel_size_m); }
  std::unique_ptr<ProbedMapper> makeMapper() const { return makeProbedMapper(params, rules); }
};

/// A measured value with its unit ("%", "mm", "cm2", or empty for a count) and its limits.
struct Figure {
  std::string name, unit;
  double value;
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();

  bool isBounded() const { return std::isfinite(least) || std::isfinite(most); }
  /// Whether the value is within its limits, if there are any; NaN never is.
  bool holds() const { return !isBounded() || (value >= least && value <= most); }
};

Figure atMost(const std::string& name, double most, const std::string& unit, double value);
Figure atLeast(const std::string& name, double least, const std::string& unit, double value);
Figure within(const std::string& name, double least, double most, const std::string& unit,
              double value);
Figure reported(const std::string& name, const std::string& unit, double value);

/// "<= 2", ">= 1" or "1 to 2"; empty if there is no limit.
std::string describeBound(const Figure& figure);

/// One variant of a scene. Its measurements depend only on the setup.
struct SceneCase {
  std::string scene, variant;
  bool quick;  ///< Whether the tests run it.
  std::function<std::vector<Figure>(const SceneSetup&)> measure;

  std::string name() const { return scene + ": " + variant; }
};

/// All cases, in the order in which they are reported.
std::vector<SceneCase> allSceneCases();

}  // namespace dtsdf
