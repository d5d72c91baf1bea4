#include "dtsdf_mapping/params/param_set.h"

#include <gtest/gtest.h>

#include <limits>

namespace dtsdf {
namespace {

enum class Fruit { kApple, kPear };

struct Params {
  bool flag = true;
  int count = 3;
  float size = 0.02f;
  double precise = 0.1;
  std::string name = "none";
  Fruit fruit = Fruit::kApple;
};

template <class Visitor>
void visitParams(Params& p, Visitor& visit) {
  visit("part/flag", p.flag);
  visit("part/count", p.count, Range{1, 10});
  visit("part/size", p.size, Range{0.001, 1.0});
  visit("part/precise", p.precise, Range{-1.0, 1.0});
  visit("part/name", p.name);
  visit("part/fruit", p.fruit, EnumNames<Fruit>{{"apple", Fruit::kApple}, {"pear", Fruit::kPear}});
}

Params read(const ParamTree& tree) {
  Params params;
  ParamReader reader(tree);
  visitParams(params, reader);
  reader.finish();
  return params;
}

std::vector<std::string> violationsOf(const ParamTree& tree) {
  try {
    read(tree);
  } catch (const ParamError& e) {
    return e.violations();
  }
  return {};
}

TEST(ParamSet, ReadsEveryType) {
  const Params params = read({{"part/flag", false},
                              {"part/count", 7},
                              {"part/size", 0.5},
                              {"part/precise", -0.25},
                              {"part/name", std::string("some")},
                              {"part/fruit", std::string("pear")}});
  EXPECT_FALSE(params.flag);
  EXPECT_EQ(params.count, 7);
  EXPECT_EQ(params.size, 0.5f);
  EXPECT_EQ(params.precise, -0.25);
  EXPECT_EQ(params.name, "some");
  EXPECT_EQ(params.fruit, Fruit::kPear);
}

TEST(ParamSet, RefusesWrongTypes) {
  const std::pair<std::string, ParamValue> wrong[] = {
      {"part/flag", 1},     {"part/flag", std::string("maybe")},
      {"part/count", 3.0},  {"part/count", std::string("3")},
      {"part/count", true}, {"part/size", std::string("0.1")},
      {"part/size", true},  {"part/name", 5},
      {"part/fruit", 1},    {"part/fruit", std::string("Aple")}};
  for (const auto& [key, value] : wrong) {
    const auto violations = violationsOf({{key, value}});
    ASSERT_EQ(violations.size(), 1u) << key << " = " << toString(value);
    EXPECT_EQ(violations[0].find(key + " = " + toString(value) + ": "), 0u) << violations[0];
  }
}

TEST(ParamSet, RangesIncludeTheirEnds) {
  for (int count : {1, 10}) EXPECT_EQ(read({{"part/count", count}}).count, count);
  for (int count : {0, 11, -2147483647}) {
    EXPECT_EQ(violationsOf({{"part/count", count}}).size(), 1u) << count;
  }
  for (double size : {0.001, 1.0}) EXPECT_NO_THROW(read({{"part/size", size}})) << size;
  for (double size : {0.0009, 1.001, std::numeric_limits<double>::infinity(),
                      std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(violationsOf({{"part/size", size}}).size(), 1u) << size;
  }
}

TEST(ParamSet, RefusesUnknownKeysAndSuggestsKnownKeys) {
  const auto violations = violationsOf({{"part/cuont", 5}});
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].find("part/cuont = 5: no such setting; known: part/count, part/"), 0u)
      << violations[0];
  EXPECT_EQ(violationsOf({{"count", 5}})[0], "count = 5: no such setting; known: part/count");
  EXPECT_EQ(violationsOf({{"prat/count", 5}})[0],
            "prat/count = 5: no such setting; known: part/count");
  EXPECT_EQ(violationsOf({{"something/else", 5}})[0], "something/else = 5: no such setting");
}

TEST(ParamSet, ErrorsNameTheUnitOfTheRange) {
  double length_m = 1.0, share = 0.5;
  ParamReader reader({{"length_m", 5.0}, {"share", 5.0}});
  reader("length_m", length_m, Range{0.001, 1.0});
  reader("share", share, Range{0.0, 1.0});
  try {
    reader.finish();
    FAIL();
  } catch (const ParamError& error) {
    EXPECT_EQ(error.violations(),
              (std::vector<std::string>{"length_m = 5: must be from 0.001 to 1 m",
                                        "share = 5: must be from 0 to 1"}));
    EXPECT_EQ(std::string(error.what()).find("invalid settings:"), 0u);
  }
}

enum class Use { kAuto, kAlways, kNever };

TEST(ParamSet, AcceptsYamlBooleans) {
  const auto readUse = [](const ParamValue& value) {
    Use use = Use::kAuto;
    ParamReader reader({{"use", value}});
    reader("use", use,
           EnumNames<Use>{{"auto", Use::kAuto}, {"always", Use::kAlways}, {"never", Use::kNever}});
    reader.finish();
    return use;
  };
  EXPECT_EQ(readUse(true), Use::kAlways) << "YAML reads `on` as true";
  EXPECT_EQ(readUse(false), Use::kNever) << "YAML reads `off` as false";
  EXPECT_EQ(readUse(std::string("Always")), Use::kAlways);
  EXPECT_THROW(readUse(1), ParamError);
  EXPECT_NE(violationsOf({{"part/fruit", true}})[0].find("must be one of: "), std::string::npos);
  for (const char* word : {"on", "Yes", "TRUE", "y"}) {
    bool flag = false;
    ParamReader reader({{"flag", std::string(word)}});
    reader("flag", flag);
    EXPECT_NO_THROW(reader.finish()) << word;
    EXPECT_TRUE(flag) << word;
  }
  for (const char* word : {"off", "No", "FALSE", "N"}) {
    bool flag = true;
    ParamReader reader({{"flag", std::string(word)}});
    reader("flag", flag);
    EXPECT_NO_THROW(reader.finish()) << word;
    EXPECT_FALSE(flag) << word;
  }
}

TEST(ParamSet, ReportsAddedViolations) {
  Params params;
  ParamReader reader({{"part/count", 4}});
  visitParams(params, reader);
  reader.addViolation("part/count", "must be odd");
  try {
    reader.finish();
    FAIL() << "a violation should be reported";
  } catch (const ParamError& e) {
    EXPECT_EQ(e.violations(), std::vector<std::string>{"part/count = 4: must be odd"});
  }
}

TEST(ParamSet, ReadsWhatItWrites) {
  Params params;
  params.fruit = Fruit::kPear;
  params.size = 0.3f;
  ParamWriter writer;
  visitParams(params, writer);
  EXPECT_EQ(writer.tree.size(), 6u);
  EXPECT_EQ(writer.tree.at("part/size"), ParamValue(0.3));  // not 0.300000012
  EXPECT_EQ(writer.tree.at("part/fruit"), ParamValue(std::string("pear")));
  EXPECT_EQ(read(writer.tree).size, 0.3f);
}

}  // namespace
}  // namespace dtsdf
