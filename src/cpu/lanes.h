/// Vectors of eight values for a whole row of voxels or mesh units, with operators and the
/// functions of kernels/core/select.h.
///
/// Each lane gives exactly the result of the scalar operation. Compilers translate these types to
/// the vector instructions of the target, such as AVX2 (widest_vectors.h), SSE2 or NEON.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "kernels/core/select.h"

namespace dtsdf {

constexpr int kLanes = 8;

template <class T>
struct Lanes {
  typedef T Vector __attribute__((vector_size(32)));  // with `using`, GCC ignores the attribute
  Vector v;

  // cppcheck-suppress uninitMemberVar  ; like an int or a float
  Lanes() = default;
  /// Through an array, as GCC would insert one lane after another for `all - Vector{}`.
  explicit Lanes(T all) {
    T values[kLanes];
    for (T& value : values) value = all;
    std::memcpy(&v, values, sizeof(v));
  }
  explicit Lanes(const Vector& vector) : v(vector) {}
  // By default, GCC copies the struct in halves. Loading the whole vector right after that would
  // stall, as store forwarding fails.
  Lanes(const Lanes& other) : v(other.v) {}
  Lanes& operator=(const Lanes& other) {
    v = other.v;
    return *this;
  }

  static Lanes load(const T* values) {
    Lanes result;
    std::memcpy(&result.v, values, sizeof(result.v));
    return result;
  }
  void store(T* values) const { std::memcpy(values, &v, sizeof(v)); }
};
/// In a mask, all bits of a lane are set if the condition holds there, otherwise none.
using LaneInts = Lanes<int32_t>;
using LaneFloats = Lanes<float>;

inline LaneInts operator&(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v & b.v); }
inline LaneInts operator|(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v | b.v); }
inline LaneInts operator^(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v ^ b.v); }
inline LaneInts operator==(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v == b.v); }
inline LaneInts operator>(const LaneInts& a, const LaneInts& b) { return LaneInts(a.v > b.v); }
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

inline LaneFloats toFloats(const LaneInts& a) {
  return LaneFloats(__builtin_convertvector(a.v, LaneFloats::Vector));
}
inline LaneInts bitsOf(const LaneFloats& a) {
  return LaneInts(reinterpret_cast<LaneInts::Vector>(a.v));
}
inline LaneFloats floatsOf(const LaneInts& a) {
  return LaneFloats(reinterpret_cast<LaneFloats::Vector>(a.v));
}

/// Converts the lowest eight bits of a number to a mask, one bit per lane.
inline LaneInts maskOf(uint32_t bits) {
  constexpr LaneInts::Vector kBit = {1, 2, 4, 8, 16, 32, 64, 128};
  return LaneInts((LaneInts(static_cast<int32_t>(bits)).v & kBit) != 0);
}

inline LaneInts select(const LaneInts& mask, const LaneInts& yes, const LaneInts& no) {
  return LaneInts((mask.v & yes.v) | (~mask.v & no.v));
}
inline LaneFloats select(const LaneInts& mask, const LaneFloats& yes, const LaneFloats& no) {
  return floatsOf(select(mask, bitsOf(yes), bitsOf(no)));
}

inline bool any(const LaneInts& mask) {
  using Pairs = int64_t __attribute__((vector_size(32)));
  const Pairs pairs = reinterpret_cast<Pairs>(mask.v);
  return (pairs[0] | pairs[1] | pairs[2] | pairs[3]) != 0;
}

/// Always true: some lane most likely needs the branch, so taking it is faster than testing.
inline bool shouldBranch(const LaneInts&) { return true; }

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
