#include "scenes/scene_case.h"

#include "params/text.h"
#include "scenes/cases.h"

namespace dtsdf {

Figure atMost(const std::string& name, double most, const std::string& unit, double value) {
  Figure figure{name, unit, value};
  figure.most = most;
  return figure;
}

Figure atLeast(const std::string& name, double least, const std::string& unit, double value) {
  Figure figure{name, unit, value};
  figure.least = least;
  return figure;
}

Figure within(const std::string& name, double least, double most, const std::string& unit,
              double value) {
  return {name, unit, value, least, most};
}

Figure reported(const std::string& name, const std::string& unit, double value) {
  return {name, unit, value};
}

std::string describeBound(const Figure& figure) {
  const bool above = std::isfinite(figure.least);
  if (above && std::isfinite(figure.most)) {
    return formatted("%.4g to %.4g", figure.least, figure.most);
  }
  if (!figure.isBounded()) return "";
  return formatted("%s %.4g", above ? ">=" : "<=", above ? figure.least : figure.most);
}

std::vector<SceneCase> allSceneCases() {
  std::vector<SceneCase> cases;
  addNearAfterFarCases(cases);
  addRemovedCases(cases);
  addAppearingCases(cases);
  addSlatCases(cases);
  addUncontradictedCases(cases);
  addDriftCases(cases);
  addStrayCases(cases);
  addMixedPixelCases(cases);
  addOutlineCases(cases);
  addMemoryCases(cases);
  return cases;
}

}  // namespace dtsdf
