/// Compares arrays byte by byte: unlike with ==, NaN equals itself and -0 differs from 0. Does not
/// depend on gtest, so fuzzers can use it.
#pragma once

#include <cstring>

namespace dtsdf {

/// Works for std::vector and PlainArray.
template <class Array>
bool sameBytes(const Array& a, const Array& b) {
  return a.size() == b.size() &&
         (a.size() == 0 || std::memcmp(a.data(), b.data(), a.size() * sizeof(*a.data())) == 0);
}

}  // namespace dtsdf
