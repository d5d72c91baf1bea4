#include "dtsdf_mapping/io/yaml_params.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

std::string errorFor(const std::string& text) {
  return errorOf([&] { parseYamlParams(text, "file.yaml"); });
}

TEST(YamlParams, FlattensSectionsAndKeepsTypes) {
  const ParamTree tree = parseYamlParams(
      "backend: cpu\n"
      "map:\n"
      "  voxel_size_m: 0.01\n"
      "  directional: true\n"
      "  max_memory_mb: 512\n"
      "fusion: {mode: ray_casting, max_weight: 1.0e+4}\n"
      "map/truncation_voxels: 4\n",
      "file.yaml");
  const ParamTree expected = {
      {"backend", std::string("cpu")}, {"map/voxel_size_m", 0.01},
      {"map/directional", true},       {"map/max_memory_mb", 512},
      {"map/truncation_voxels", 4},    {"fusion/mode", std::string("ray_casting")},
      {"fusion/max_weight", 1.0e4}};
  EXPECT_EQ(tree, expected);
}

TEST(YamlParams, DistinguishesStringsNumbersAndBooleans) {
  const ParamTree tree = parseYamlParams(
      "a: yes\nb: Off\nc: '5'\nd: \"true\"\ne: -7\nf: .5\ng: 1e3\nh: 99999999999\n"
      "i: 0x10\nj: y\nk: 1 2\nl: 010\n",
      "file.yaml");
  const ParamTree expected = {{"a", true},
                              {"b", false},
                              {"c", std::string("5")},
                              {"d", std::string("true")},
                              {"e", -7},
                              {"f", 0.5},
                              {"g", 1000.0},
                              {"h", 99999999999.0},
                              {"i", std::string("0x10")},
                              {"j", std::string("y")},
                              {"k", std::string("1 2")},
                              {"l", 10}};
  EXPECT_EQ(tree, expected);
}

TEST(YamlParams, AnEmptyFileGivesAnEmptyTree) {
  EXPECT_TRUE(parseYamlParams("", "file.yaml").empty());
  EXPECT_TRUE(parseYamlParams("# only a comment\n", "file.yaml").empty());
  EXPECT_TRUE(parseYamlParams("map: {}\n", "file.yaml").empty());
}

TEST(YamlParams, ErrorsNameFileAndLine) {
  const std::pair<std::string, std::string> cases[] = {
      {"a: 1\nb: [1, 2]\n", "file.yaml:2: b: a list"},
      {"map:\n  voxel_size_m:\n", "file.yaml:2: map/voxel_size_m has no value"},
      {"map:\n  a: 1\nmap/a: 2\n", "file.yaml:3: map/a is given twice"},
      {"a: 1\na: 2\n", "file.yaml:2: a is given twice"},
      {"a: 1\n? [1, 2]\n: 3\n", "file.yaml:2: a key must be"},
      {"just a text\n", "file.yaml:1: settings must be"},
      {"- a\n- b\n", "file.yaml:1: settings must be"},
      {"a: 1\nb: {c: 1\n", "not valid YAML"},
      {"a: 1\n\tb: 2\n", "file.yaml:2: not valid YAML"},
      {"a: *nowhere\n", "file.yaml:1: not valid YAML"},
  };
  for (const auto& [text, expected] : cases) {
    EXPECT_NE(errorFor(text).find(expected), std::string::npos) << text << "-> " << errorFor(text);
  }
}

TEST(YamlParams, LoadsFilesAndNamesUnreadableOnes) {
  const TemporaryFolder folder;
  writeBytes(folder / "a.yaml", "map: {directional: false}\n");
  EXPECT_EQ(loadYamlParams(folder / "a.yaml"), (ParamTree{{"map/directional", false}}));
  writeBytes(folder / "b.yaml", "a: [\n");
  for (const std::string& path : {folder / "b.yaml", folder / "none.yaml", folder.path()}) {
    const std::string error = errorOf([&] { loadYamlParams(path); });
    EXPECT_NE(error.find(path), std::string::npos) << error;
  }
}

/// Repeats a string, for example `[` to get deep nesting.
std::string repeated(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

TEST(YamlParams, FollowsOnlyFiniteAliases) {
  EXPECT_EQ(parseYamlParams("a: &a 1\nb: *a\n", "file"), (ParamTree{{"a", 1}, {"b", 1}}));
  // An alias inside the node that it refers to would expand forever. Each of 24 lists contains the
  // previous list twice, so the last list would expand to 33 million values.
  std::string doubled = "a0: &a0 [x, x]\n";
  for (int i = 1; i <= 24; ++i) {
    const std::string before = "*a" + std::to_string(i - 1), name = "a" + std::to_string(i);
    doubled += name + ": &" + name + " [" + before + ", " + before + "]\n";
  }
  for (const std::string& text :
       {std::string("a: &a\n  b: *a\n"), std::string("&a [*a]"), doubled}) {
    EXPECT_NE(errorOf([&] { parseYamlParams(text, "file"); }), "") << text.substr(0, 40);
  }
  ParamTree tree;
  EXPECT_NE(errorOf([&] { setParam("cameras=&a [*a]", tree); }), "");
  EXPECT_EQ(parseYamlParams("a: &name 1\n", "file").size(), 1u);
}

TEST(YamlParams, RefusesNul) {
  ParamTree tree;
  EXPECT_NE(errorOf([&] { setParam(std::string("\0:a=b", 5), tree); })[0], '\0');
}

TEST(YamlParams, RefusesMultipleDocuments) {
  EXPECT_NE(errorOf([] { parseYamlParams("a: 1\n---\nb: 2\n", "file"); }).find("document"),
            std::string::npos);
  EXPECT_EQ(parseYamlParams("---\na: 1\n...\n", "file").size(), 1u);
}

TEST(YamlParams, RefusesExcessiveDepthAndSize) {
  for (const std::string& text :
       {"a: " + repeated("[", 100), "a: " + repeated("[", 500000), repeated("- ", 100000),
        repeated("? ", 100000), repeated("{a: ", 9000), repeated("-", 60) + "a",
        repeated("a: 1\n", 300000)}) {
    EXPECT_NE(errorOf([&] { parseYamlParams(text, "file"); }), "") << text.substr(0, 20);
  }
  std::string stairs;
  for (int i = 0; i < 200; ++i) stairs += std::string(i, ' ') + "a:\n";
  EXPECT_NE(errorOf([&] { parseYamlParams(stairs, "file"); }).find("levels"), std::string::npos);
}

TEST(YamlParams, SetsKeysFromAssignments) {
  ParamTree tree = {{"map/voxel_size_m", 0.02}};
  setParam("map/voxel_size_m=0.01", tree);
  setParam("backend=cpu", tree);
  setParam("map/directional=false", tree);
  setParam("name='a=b'", tree);
  const ParamTree expected = {{"map/voxel_size_m", 0.01},
                              {"backend", std::string("cpu")},
                              {"map/directional", false},
                              {"name", std::string("a=b")}};
  EXPECT_EQ(tree, expected);
}

TEST(YamlParams, RefusesInvalidAssignments) {
  for (const char* text : {"", "=", "key", "key=", "=1", "key=[1]", "key=a: b", "key={", "key=#"}) {
    ParamTree tree;
    EXPECT_NE(errorOf([&] { setParam(text, tree); }), "") << text;
    EXPECT_TRUE(tree.empty()) << text;
  }
}

}  // namespace
}  // namespace dtsdf
