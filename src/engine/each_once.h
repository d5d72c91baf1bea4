/// Lists that name things once.
#pragma once

#include <algorithm>
#include <vector>

namespace dtsdf {

/// In ascending order.
template <class T>
void keepEachOnce(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace dtsdf
