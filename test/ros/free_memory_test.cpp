#include "ros/common/free_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include "ros/support/fake_clock.h"

namespace dtsdf {
namespace {

using Pieces = std::vector<std::unique_ptr<char[]>>;

size_t residentBytes() {
  size_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

constexpr size_t kPieceBytes = 64 << 10, kPieces = 1024, kMegabyte = 1 << 20;

/// Pieces from the pool of another thread, all freed but the last, which keeps the others' place.
Pieces leftOfMany() {
  Pieces pieces;
  std::thread([&] {
    for (size_t i = 0; i < kPieces; ++i) {
      pieces.push_back(std::make_unique<char[]>(kPieceBytes));  // zeroed, so that it is resident
    }
  }).join();
  pieces.erase(pieces.begin(), pieces.end() - 1);
  return pieces;
}

// Sanitizers have pools of their own. GCC says it by macros, clang by features.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DTSDF_HAS_SANITIZER
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define DTSDF_HAS_SANITIZER
#endif
#endif

bool canReturnMemory() {
#if defined(__GLIBC__) && !defined(DTSDF_HAS_SANITIZER)
  return true;
#else
  return false;
#endif
}

TEST(FreeMemory, IsGivenBackOnceInAWhile) {
  if (!canReturnMemory()) GTEST_SKIP() << "not by this C library";
  FakeClock clock;
  FreeMemory memory(clock.reader());
  memory.step();
  const size_t before = residentBytes();
  const Pieces left = leftOfMany();
  clock.advance(1.0);
  memory.step();
  EXPECT_GT(residentBytes(), before + 50 * kMegabyte) << "too soon";
  clock.advance(60.0);
  memory.step();
  EXPECT_LT(residentBytes(), before + 10 * kMegabyte);
}

}  // namespace
}  // namespace dtsdf
