/// Runs loops with AVX2 if the processor supports it, in optimised GCC builds for x86-64. The rest
/// of the build does not require AVX2.
#pragma once

namespace dtsdf {

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__OPTIMIZE__)

/// Everything that `loops` calls is inlined here, and thus compiled for AVX2. As the target does
/// not include fused multiply-add, results are bitwise equal on all processors. Without noipa, GCC
/// 12 removes calls to this function at -O2 (build type RelWithDebInfo), and maps stay empty.
template <class Loops>
__attribute__((target("avx2"), flatten, noipa)) void runWithAvx2(const Loops& loops) {
  loops();
}

inline bool hasAvx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}

/// Runs loops. The compiler must be able to inline everything that they call.
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
