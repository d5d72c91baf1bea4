/// Whether two arrays have the same bytes: stricter than ==, which no number that is not one passes
/// and to which -0 is 0. Without gtest, for the fuzzers too.
#pragma once

#include <cstring>

namespace dtsdf {

/// Compares vectors or PlainArrays bytewise.
template <class Array>
bool sameBytes(const Array& a, const Array& b) {
  return a.size() == b.size() &&
         (a.size() == 0 || std::memcmp(a.data(), b.data(), a.size() * sizeof(*a.data())) == 0);
}

}  // namespace dtsdf
