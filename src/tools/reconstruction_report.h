/// The report of `reconstruct`, as JSON.
#pragma once

#include <string>
#include <vector>

#include "tools/reconstruction.h"

namespace dtsdf {

struct Summary {
  double mean = 0.0, median = 0.0, p95 = 0.0, worst = 0.0;
};

/// Median: the middle value, or the mean of the two middle ones. p95: the smallest value that at
/// least 95 % of the values do not exceed. All are 0 if there are no values.
Summary summarise(std::vector<double> values);

/// @param backend_name From Mapper::backendName().
std::string reportJson(const ReconstructionResult& result, const std::string& backend_name);

}  // namespace dtsdf
