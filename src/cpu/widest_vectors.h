/// Loops with the widest vector instructions that the processor has, beside those that every one of
/// its kind has.
#pragma once

namespace dtsdf {

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__)

/// Everything that `loops` calls is compiled into this function, and so with its instructions. AVX2
/// is without fused multiply-add: the bits are those of any other processor.
template <class Loops>
__attribute__((target("avx2"), flatten, noipa)) void runWithAvx2(const Loops& loops) {
  loops();
}

inline bool hasAvx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}

/// Runs plain loops. They hold no calls that the compiler cannot see into.
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
