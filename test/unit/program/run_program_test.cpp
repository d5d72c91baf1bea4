#include "program/run_program.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace dtsdf {
namespace {

/// What a program writes to standard error if it fails with this text.
std::string outputOf(const std::string& text) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(runProgram("a_tool", 0, nullptr,
                       [&](const std::vector<std::string>&) { throw std::runtime_error(text); }),
            1);
  return testing::internal::GetCapturedStderr();
}

TEST(RunProgram, PrintsAnErrorOnOneLine) {
  EXPECT_EQ(outputOf("no file 'a';\ngive one"), "a_tool: error: no file 'a'; give one\n");
}

TEST(RunProgram, EscapesControlCharacters) {
  EXPECT_EQ(outputOf("no file 'a\x1b[2Jb\rü'"), "a_tool: error: no file 'a\\x1b[2Jb\\x0dü'\n");
}

TEST(RunProgramDeathTest, FailedOutputIsAnError) {
  const auto print = [](const std::vector<std::string>&) { std::puts("a report"); };
  EXPECT_EXIT(
      {
        if (std::freopen("/dev/full", "w", stdout) == nullptr) std::exit(3);
        std::exit(runProgram("a_tool", 0, nullptr, print));
      },
      testing::ExitedWithCode(1), "a_tool: error: .*standard output");
}

}  // namespace
}  // namespace dtsdf
