/// Four values in one vector register: the operations of kernels/core/select.h for four units at
/// once.
///
/// Each lane gives the same bits as the operation on a single value. GCC's vector types become
/// SSE2, NEON or what else there is, without code for any of them.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "kernels/core/select.h"

namespace dtsdf {

constexpr int kLanes = 4;

/// Integers, or masks: all bits of a lane are set where a condition holds.
struct LaneInts {
  using Vector = int32_t __attribute__((vector_size(16)));
  Vector v;

  // cppcheck-suppress uninitMemberVar  ; as an int or a float is
  LaneInts() = default;
  explicit LaneInts(int32_t all) : v{all, all, all, all} {}
  explicit LaneInts(Vector vector) : v(vector) {}
};

struct LaneFloats {
  using Vector = float __attribute__((vector_size(16)));
  Vector v;

  // cppcheck-suppress uninitMemberVar  ; as an int or a float is
  LaneFloats() = default;
  explicit LaneFloats(float all) : v{all, all, all, all} {}
  explicit LaneFloats(Vector vector) : v(vector) {}

  static LaneFloats load(const float* four) {
    LaneFloats result;
    std::memcpy(&result.v, four, sizeof(result.v));
    return result;
  }
};

inline LaneInts operator&(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v & b.v); }
inline LaneInts operator|(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v | b.v); }
inline LaneInts operator^(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v ^ b.v); }
inline LaneInts operator==(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v == b.v); }
inline LaneInts operator!=(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v != b.v); }

inline LaneFloats operator+(const LaneFloats& a, const LaneFloats& b) {
  return LaneFloats(a.v + b.v);
}
inline LaneFloats operator-(const LaneFloats& a, const LaneFloats& b) {
  return LaneFloats(a.v - b.v);
}
inline LaneFloats operator*(const LaneFloats& a, const LaneFloats& b) {
  return LaneFloats(a.v * b.v);
}
inline LaneFloats operator/(const LaneFloats& a, const LaneFloats& b) {
  return LaneFloats(a.v / b.v);
}
inline LaneInts operator<(const LaneFloats& a, const LaneFloats& b) { return LaneInts(a.v < b.v); }
inline LaneInts operator>(const LaneFloats& a, const LaneFloats& b) { return LaneInts(a.v > b.v); }
inline LaneInts operator>=(const LaneFloats& a, const LaneFloats& b) {
  return LaneInts(a.v >= b.v);
}

inline LaneInts bitsOf(const LaneFloats& a) {
  return LaneInts(reinterpret_cast<LaneInts::Vector>(a.v));
}
inline LaneFloats floatsOf(const LaneInts& a) {
  return LaneFloats(reinterpret_cast<LaneFloats::Vector>(a.v));
}

inline LaneInts select(const LaneInts& mask, const LaneInts& yes, const LaneInts& no) {
  return LaneInts((mask.v & yes.v) | (~mask.v & no.v));
}
inline LaneFloats select(const LaneInts& mask, const LaneFloats& yes, const LaneFloats& no) {
  return floatsOf(select(mask, bitsOf(yes), bitsOf(no)));
}

inline bool any(const LaneInts& mask) {
  using Halves = int64_t __attribute__((vector_size(16)));
  const Halves halves = reinterpret_cast<Halves>(mask.v);
  return (halves[0] | halves[1]) != 0;
}

inline LaneFloats maximum(const LaneFloats& a, const LaneFloats& b) { return select(a > b, a, b); }
inline LaneFloats magnitude(const LaneFloats& a) {
  return floatsOf(bitsOf(a) & LaneInts(0x7fffffff));
}
inline LaneFloats squareRoot(const LaneFloats& a) {
  LaneFloats result;
  for (int k = 0; k < kLanes; ++k) result.v[k] = std::sqrt(a.v[k]);
  return result;
}

inline float lane(const LaneFloats& value, int k) { return value.v[k]; }
inline int32_t lane(const LaneInts& value, int k) { return value.v[k]; }

}  // namespace dtsdf
