#include "params/node_params.h"

#include <dtsdf_mapping/PublishConfig.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <regex>

#include "ros/input/frame_accounting.h"

namespace dtsdf {
namespace {

double asNumber(const ParamValue& value) {
  if (const int* whole = std::get_if<int>(&value)) return *whole;
  const double* number = std::get_if<double>(&value);
  return number != nullptr ? *number : NAN;
}

std::vector<std::string> violationsOf(const ParamTree& tree) {
  try {
    readNodeParams(tree);
  } catch (const ParamError& error) {
    return error.violations();
  }
  return {};
}

TEST(NodeParams, DocumentationNamesEveryKeyAndDropReason) {
  std::ifstream file(DTSDF_DOCS_FOLDER "/ros.md");
  const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  for (const auto& [key, value] : toTree(NodeParams())) {
    EXPECT_NE(text.find("`" + key + "`"), std::string::npos)
        << key << " should be described in docs/ros.md";
  }
  std::ifstream header(DTSDF_DOCS_FOLDER "/../src/ros/input/frame_accounting.h");
  const std::string code{std::istreambuf_iterator<char>(header), std::istreambuf_iterator<char>()};
  const std::regex reason(R"x(constexpr DropReason k\w+\{\s*"(\w+)")x");
  size_t reasons = 0;
  for (std::sregex_iterator it(code.begin(), code.end(), reason), end; it != end; ++it) {
    ++reasons;
    EXPECT_NE(text.find("`" + it->str(1) + "`"), std::string::npos) << it->str(1);
  }
  EXPECT_GT(reasons, 20u);
}

TEST(NodeParams, LevelledMapsHaveAFrameOfTheirOwn) {
  const auto frameOf = [](const ParamTree& tree) { return frameOfMap(readNodeParams(tree)); };
  const std::string floor = "floor";
  EXPECT_EQ(frameOf({{"map_frame", std::string("odom")}}), "odom");
  EXPECT_EQ(frameOf({{"map_frame", std::string("odom")}, {"map/level", floor}}), "odom_level");
  EXPECT_EQ(frameOf({{"map/level", floor}, {"map/level_frame", std::string("/site")}}), "site");
  EXPECT_EQ(frameOf({{"map/level_frame", std::string("site")}}), "map")
      << "map/level_frame should be ignored if the map is not levelled";
  EXPECT_EQ(violationsOf({{"map/level", floor}, {"map/level_frame", std::string("/map")}}).size(),
            1u);
  EXPECT_EQ(violationsOf({{"map/level", std::string("gravity")}}).size(), 1u);
}

TEST(NodeParams, InconsistentPoseSettingsAreRejected) {
  const auto broken = [](ParamTree tree, const char* key) {
    const auto violations = violationsOf(tree);
    return violations.size() == 1 && violations[0].find(key) != std::string::npos;
  };
  const std::string refine = "refine", track = "track", odom = "odom", map = "map";
  EXPECT_TRUE(violationsOf({{"poses/mode", refine},
                            {"poses/odom_frame", odom},
                            {"poses/base_frame", std::string("base")}})
                  .empty());
  EXPECT_TRUE(broken({{"poses/odom_frame", map}}, "poses/odom_frame"));
  EXPECT_TRUE(broken({{"poses/base_frame", std::string("/map")}}, "poses/base_frame"));
  EXPECT_TRUE(broken({{"poses/odom_frame", odom}, {"poses/base_frame", odom}}, "poses/base_frame"));
  EXPECT_TRUE(
      broken({{"map/level", std::string("floor")}, {"poses/odom_frame", std::string("map_level")}},
             "poses/odom_frame"));
  const std::vector<std::string> two{"front", "rear"};
  EXPECT_TRUE(broken({{"poses/mode", track}, {"cameras", two}}, "poses/mode"));
  EXPECT_TRUE(violationsOf({{"poses/mode", refine}, {"cameras", two}}).empty());
  EXPECT_TRUE(broken({{"poses/mode", track}, {"map/level", std::string("imu")}}, "map/level"));
}

TEST(NodeParams, PoseFrameDependsOnTheMode) {
  const auto frameOf = [](const std::string& mode, const std::string& odom) {
    return frameOfPoses(readNodeParams(
        {{"poses/mode", mode}, {"poses/odom_frame", odom}, {"map_frame", std::string("world")}}));
  };
  EXPECT_EQ(frameOf("tf", "/odom"), "world");
  EXPECT_EQ(frameOf("refine", "/odom"), "odom");
  EXPECT_EQ(frameOf("refine", ""), "world");
  EXPECT_EQ(frameOf("track", "/odom"), "");
}

TEST(NodeParams, CamerasAreDistinctNamespaces) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(readNodeParams({{"cameras", Names{"front", "left/rear_2"}}}).cameras,
            (Names{"front", "left/rear_2"}));
  const Names long_name{std::string(100'000, 'a')};
  EXPECT_EQ(readNodeParams({{"cameras", long_name}}).cameras, long_name);
  for (const std::string bad : {"", "/front", "2nd", "front/", "a//b", "a b", "a-b"}) {
    EXPECT_EQ(violationsOf({{"cameras", Names{bad}}}).size(), 1u) << bad;
  }
  EXPECT_EQ(violationsOf({{"cameras", Names{"a", "a"}}}).size(), 1u);
  EXPECT_EQ(violationsOf({{"cameras", std::string("front")}}).size(), 1u);
  EXPECT_EQ(
      violationsOf({{"cameras", Names{"a", "b"}}, {"input/camera_frame", std::string("c")}}).size(),
      1u);
}

/// The rates in dynamic_reconfigure must have the same names, defaults and ranges as the node's
/// parameters.
TEST(NodeParams, ReconfigurableRatesMatchTheSettings) {
  const auto minimum = dtsdf_mapping::PublishConfig::__getMin__();
  const auto defaults = dtsdf_mapping::PublishConfig::__getDefault__();
  const auto maximum = dtsdf_mapping::PublishConfig::__getMax__();
  const ParamTree settings = toTree(NodeParams());
  size_t rates = 0;
  for (const auto& [key, value] : settings) {
    if (key.rfind("publish/", 0) == 0 && key.find("_rate_hz") != std::string::npos) ++rates;
  }
  const auto descriptions = dtsdf_mapping::PublishConfig::__getParamDescriptions__();
  size_t offered = 0;
  for (const auto& description : descriptions) {
    const std::string key = "publish/" + description->name;
    ASSERT_EQ(settings.count(key), 1u) << key;
    boost::any any;
    description->getValue(defaults, any);
    EXPECT_EQ(boost::any_cast<double>(any), asNumber(settings.at(key))) << key;
    for (const auto& bound : {minimum, maximum}) {
      description->getValue(bound, any);
      const double number = boost::any_cast<double>(any);
      EXPECT_TRUE(violationsOf({{key, number}}).empty()) << key << " = " << number;
      EXPECT_FALSE(
          violationsOf({{key, bound.mesh_rate_hz < 1.0 ? 0.9 * number : 1.1 * number}}).empty());
    }
    ++offered;
  }
  EXPECT_EQ(offered, rates);
}

TEST(NodeParams, StripsLeadingSlashesOfFrames) {
  const NodeParams params = readNodeParams(
      {{"map_frame", std::string("/odom")}, {"input/camera_frame", std::string("/cam")}});
  EXPECT_EQ(params.map_frame, "odom");
  EXPECT_EQ(params.input.camera_frame, "cam");
}

}  // namespace
}  // namespace dtsdf
