/// Runs loops with the widest vector instructions of the processor, beyond those that all of its
/// architecture have.
#pragma once

namespace dtsdf {

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__)

/// All that `loops` calls is inlined into this function, and so compiled for AVX2. AVX2 has no
/// fused multiply-add, so results have the same bits as on any other processor. It needs noipa:
/// with -O2 (build type RelWithDebInfo), GCC 12 otherwise takes this function to have no effects
/// and drops calls of it, which leaves maps empty.
template <class Loops>
__attribute__((target("avx2"), flatten, noipa)) void runWithAvx2(const Loops& loops) {
  loops();
}

inline bool hasAvx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}

/// Runs plain loops; the compiler must be able to inline all that they call.
template <class Loops>
void withWidestVectors(const Loops& loops) {
  if (hasAvx2()) {
    runWithAvx2(loops);
  } else {
    loops();
  }
}

#else

template <class Loops>
void withWidestVectors(const Loops& loops) {
  loops();
}

#endif

}  // namespace dtsdf
