#include "evaluation/command_line.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace dtsdf {
namespace {

CommandLine parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "program");
  return {static_cast<int>(arguments.size()), arguments.data(), {"size", "list"}, {"help"}};
}

TEST(CommandLine, SplitsOptionsAndArguments) {
  const CommandLine line = parse({"a.ply", "--size", "3", "b.ply", "--list=1,2.5", "--help"});
  EXPECT_EQ(line.positional(), (std::vector<std::string>{"a.ply", "b.ply"}));
  EXPECT_EQ(line.number("size", 7, 0, 10), 3);
  EXPECT_EQ(line.numbers("list", {}), (std::vector<double>{1, 2.5}));
  EXPECT_TRUE(line.has("help"));
  EXPECT_EQ(parse({}).number("size", 7, 0, 10), 7);
}

TEST(CommandLine, RefusesWhatItDoesNotKnow) {
  EXPECT_THROW(parse({"--sise", "3"}), std::invalid_argument);
  EXPECT_THROW(parse({"--size"}), std::invalid_argument);
  EXPECT_THROW(parse({"--help=1"}), std::invalid_argument);
  EXPECT_THROW(parse({"--size", "3x"}).number("size", 7, 0, 10), std::invalid_argument);
  EXPECT_THROW(parse({"--size", "nan"}).number("size", 7, 0, 10), std::invalid_argument);
  EXPECT_THROW(parse({"--size", "11"}).number("size", 7, 0, 10), std::invalid_argument);
  EXPECT_THROW(parse({"--list", "1,,2"}).numbers("list", {}), std::invalid_argument);
}

}  // namespace
}  // namespace dtsdf
