/// Scenes that check whether a map contains what was seen, and nothing else: settings, cases, and
/// figures with bounds.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Settings with which a case makes its maps.
struct SceneSetup {
  MapperParams params;
  Rules rules;
  int image_width = 320;  ///< Width of the room camera's images; its focal length is fixed.

  double voxel() const { return static_cast<double>(params.map.voxel_size_m); }
  std::unique_ptr<ProbedMapper> makeMapper() const { return makeProbedMapper(params, rules); }
};

/// A measured number in its unit ("%", "mm", "cm2", or nothing for a count), and its bounds.
struct Figure {
  std::string name, unit;
  double value;
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();

  bool isBounded() const { return std::isfinite(least) || std::isfinite(most); }
  /// NaN breaks every bound.
  bool holds() const { return !isBounded() || (value >= least && value <= most); }
};

Figure atMost(const std::string& name, double most, const std::string& unit, double value);
Figure atLeast(const std::string& name, double least, const std::string& unit, double value);
Figure within(const std::string& name, double least, double most, const std::string& unit,
              double value);
Figure reported(const std::string& name, const std::string& unit, double value);

/// "<= 2", ">= 1" or "1 to 2"; empty without a bound.
std::string describeBound(const Figure& figure);

/// A scene in one of its variants. The same setup always gives the same figures.
struct SceneCase {
  std::string scene, variant;
  bool quick;  ///< Whether the tests run it.
  std::function<std::vector<Figure>(const SceneSetup&)> measure;

  std::string name() const { return scene + ": " + variant; }
};

/// Every case, in the order of the report.
std::vector<SceneCase> allSceneCases();

}  // namespace dtsdf
