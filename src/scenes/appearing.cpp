#include "scenes/cases.h"

namespace dtsdf {
void addAppearingCases(std::vector<SceneCase>&) {}
}  // namespace dtsdf
