/// The report of `reconstruct`, as JSON.
#pragma once

#include <string>
#include <vector>

#include "tools/reconstruction.h"

namespace dtsdf {

struct Summary {
  double mean = 0.0, median = 0.0, p95 = 0.0, worst = 0.0;
};

/// Median: the middle, or the mean of the two middle ones. p95: the smallest value that at least
/// 95 % of the values do not exceed. All 0 for no values.
Summary summarise(std::vector<double> values);

/// Of the frames that were refined: how far they moved from the given poses, and the mean shares of
/// their points that lie on surfaces before they were aligned, with the correction so far, and
/// after.
struct MoveSummary {
  Summary shift_mm, turn_degrees;
  double share_before = 0.0, share = 0.0;
};

MoveSummary summarise(const std::vector<PoseMove>& moves);

/// `backend_name` as Mapper::backendName() gives it.
std::string reportJson(const ReconstructionResult& result, const std::string& backend_name);

}  // namespace dtsdf
