/// Judges how mapping goes: whether all is well, and if not, what is amiss and what to do.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "ros/output/status_report.h"

namespace dtsdf {

/// A level of MapStatus, and the sentence for it. Names from outside are in it as they came.
using Verdict = std::pair<uint8_t, std::string>;

/// `before` is the last status, which shows what is new.
Verdict judge(const StatusInput& in, const dtsdf_mapping::MapStatus& before);

}  // namespace dtsdf
