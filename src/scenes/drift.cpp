#include "scenes/cases.h"

namespace dtsdf {
void addDriftCases(std::vector<SceneCase>&) {}
}  // namespace dtsdf
