#include "scenes/cases.h"

namespace dtsdf {
void addUncontradictedCases(std::vector<SceneCase>&) {}
}  // namespace dtsdf
