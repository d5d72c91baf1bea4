/// Seeds for randomised tests. They are fixed unless DTSDF_TEST_SEED sets the first seed.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>

namespace dtsdf {

/// Seed of the n-th case.
inline uint32_t caseSeed(int n) {
  const char* start = std::getenv("DTSDF_TEST_SEED");
  return (start == nullptr ? 1u : static_cast<uint32_t>(std::strtoul(start, nullptr, 10))) +
         static_cast<uint32_t>(n);
}

/// Text for SCOPED_TRACE. It contains the value of DTSDF_TEST_SEED with which this case runs first.
inline std::string describeSeed(uint32_t seed) { return "DTSDF_TEST_SEED=" + std::to_string(seed); }

}  // namespace dtsdf
