#include "program/command_line.h"

#include <gtest/gtest.h>

#include "support/error_of.h"

namespace dtsdf {
namespace {

using Arguments = std::vector<std::string>;

struct Options {
  std::string in, text = "some";
  double size = 7.0;
  std::optional<double> scale;
  int count = 3;
  std::vector<std::string> list;
  std::vector<double> numbers;
  bool flag = false;
};

void addAll(CommandLine& line, Options& options) {
  line.addText({"IN.ply", "", "the input"}, options.in);
  line.addText({"--text", "TEXT", "some text"}, options.text);
  line.addNumber({"--size", "METRES", "a number"}, options.size, {kAboveZero, 10.0});
  line.addNumber({"--scale", "S", "another"}, options.scale, {-1.0, kUnbounded});
  line.addNumber({"--count", "N", "a whole number"}, options.count, {1, 9});
  line.addList({"--list", "ITEM ...", "a list"},
               [&](const std::string& text) { options.list.push_back(text); });
  line.add({"--numbers", "A,B,...", "numbers"},
           [&](const std::string& text) { options.numbers = readNumbers(text); });
  line.add({"--odd", "ODD", "refused by another part of the program"},
           [](const std::string&) { throw std::invalid_argument("too odd"); });
  line.addFlag("--flag", "a flag", options.flag);
  line.addTextRequest("--show", "show some text", [] { return std::string("shown"); });
  line.onlyWith("--scale", "--size");
}

Options parse(const Arguments& arguments) {
  Options options;
  CommandLine line("program", "IN.ply [options]", "Does something.");
  addAll(line, options);
  line.parse(arguments);
  return options;
}

std::string usageErrorOf(const Arguments& arguments) {
  return errorOf<UsageError>([&] { parse(arguments); });
}

std::string requestedText(const Arguments& arguments) {
  return errorOf<TextRequest>([&] { parse(arguments); });
}

TEST(CommandLine, ReadsOptionsAndArguments) {
  const Options options =
      parse({"--text", "a b", "--size=2.5", "--scale", "-0.5", "a.ply", "--count", "4", "--flag",
             "--list", "x", "y", "--numbers", "-1,2.5", "--list=z=1"});
  EXPECT_EQ(options.in, "a.ply");
  EXPECT_EQ(options.text, "a b");
  EXPECT_EQ(options.size, 2.5);
  EXPECT_EQ(options.scale, -0.5);
  EXPECT_EQ(options.count, 4);
  EXPECT_TRUE(options.flag);
  EXPECT_EQ(options.list, Arguments({"x", "y", "z=1"}));
  EXPECT_EQ(options.numbers, (std::vector<double>{-1.0, 2.5}));
}

TEST(CommandLine, AcceptsDashesAfterAnEqualsSign) {
  EXPECT_EQ(parse({"a.ply", "--text=--flag"}).text, "--flag");
}

TEST(CommandLine, ErrorsNameWhatIsWrong) {
  const std::pair<Arguments, std::string> cases[] = {
      {{}, "IN.ply"},
      {{"a.ply", "b.ply"}, "'b.ply' is not expected here"},
      {{"--unknown"}, "'--unknown'"},  // reported before the missing input
      {{"a.ply", "-u"}, "-u"},
      {{"a.ply", "--text"}, "--text"},
      {{"a.ply", "--text", "--flag"}, "--text"},
      {{"a.ply", "--text", ""}, "--text"},
      {{"a.ply", "--text", "a", "--text", "b"}, "--text"},
      {{"--flag=yes", "a.ply"}, "--flag"},
      {{"a.ply", "--list"}, "--list"},
      {{"a.ply", "--size", "3x"}, "--size: '3x'"},
      {{"a.ply", "--size", "0"}, "--size: '0'"},
      {{"a.ply", "--size", "nan"}, "--size"},
      {{"a.ply", "--size", "10.1"}, "--size"},
      {{"a.ply", "--count", "1.5"}, "--count"},
      {{"a.ply", "--count", "0"}, "--count"},
      {{"a.ply", "--count", "99999999999999999999"}, "--count"},
      {{"a.ply", "--numbers", "1,,2"}, "--numbers"},
      {{"a.ply", "--numbers", "1,2,"}, "--numbers"},
      {{"a.ply", "--odd", "1"}, "--odd: too odd"},
      {{"a.ply", "--scale", "1"}, "--scale requires --size"},
  };
  for (const auto& [arguments, expected] : cases) {
    EXPECT_NE(usageErrorOf(arguments).find(expected), std::string::npos)
        << expected << " -> " << usageErrorOf(arguments);
  }
}

TEST(CommandLine, TextRequestsNeedNoOtherArguments) {
  EXPECT_EQ(requestedText({"--show"}), "shown");
  const std::string help = requestedText({"--flag", "-h"});
  for (const char* text : {"usage: program IN.ply [options]", "--size METRES",
                           "a number (default 7)", "some text (default some)"}) {
    EXPECT_NE(help.find(text), std::string::npos) << text << " is not in\n" << help;
  }
}

}  // namespace
}  // namespace dtsdf
