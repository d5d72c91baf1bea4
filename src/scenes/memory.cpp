#include "scenes/cases.h"

namespace dtsdf {
void addMemoryCases(std::vector<SceneCase>&) {}
}  // namespace dtsdf
