#include "tools/run_options.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "backend/rules.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

std::vector<std::string> violationsOf(const RunOptions& options) {
  try {
    readSettings(options);
  } catch (const ParamError& e) {
    return e.violations();
  }
  return {};
}

TEST(RunSettings, ReportsSettingsAndRulesTogether) {
  RunOptions options;
  options.settings = {"map/voxel_size_m=-1", "rules/none=1"};
  const std::vector<std::string> violations = violationsOf(options);
  ASSERT_EQ(violations.size(), 2u);
  EXPECT_EQ(violations[0].find("map/voxel_size_m = -1"), 0u) << violations[0];
  EXPECT_EQ(violations[1], "rules/none = 1: no such setting");
}

/// As in the node, frame names lose a leading slash. Otherwise, programs would refuse each other's
/// maps.
TEST(RunSettings, FramesHaveNoLeadingSlash) {
  RunOptions options;
  options.settings = {"map_frame=/odom", "input/camera_frame=/camera"};
  const NodeParams node = readSettings(options).params;
  EXPECT_EQ(node.map_frame, "odom");
  EXPECT_EQ(node.input.camera_frame, "camera");
  options.settings = {"map_frame=/"};
  EXPECT_EQ(violationsOf(options).size(), 1u);
}

TEST(SettingList, HasEveryKeyWithDefaultUnitAndRange) {
  const std::string list = listSettings();
  for (const char* line :
       {"poses/sigma_rad              0.035 rad            1e-06 to 3.2\n",
        "colour/enabled               'auto'               auto, always, never\n"}) {
    EXPECT_NE(list.find(line), std::string::npos) << line << list;
  }
  NodeParams params;
  ParamWriter writer;
  visitParams(params, writer);
  PoseParams poses;
  visitParams(poses, writer);
  EXPECT_EQ(static_cast<size_t>(std::count(list.begin(), list.end(), '\n')), writer.tree.size());
}

/// With aligned poses, the default of fusion/memory_frames is larger. An explicit setting is kept.
TEST(RunSettings, AlignedPosesLengthenTheMemory) {
  const auto memoryWith = [](const std::string& mode, std::vector<std::string> settings) {
    RunOptions options;
    options.settings = std::move(settings);
    options.settings.push_back("poses/mode=" + mode);
    return readSettings(options).params.mapper.fusion.memory_frames;
  };
  EXPECT_EQ(memoryWith("tf", {}), 0);
  EXPECT_EQ(memoryWith("refine", {}), 19);
  EXPECT_EQ(memoryWith("track", {}), 19);
  EXPECT_EQ(memoryWith("refine", {"fusion/memory_frames=5"}), 5);
}

TEST(RuleList, HasKeyValueAndRange) {
  const std::string list = listRules();
  const std::string line =
      "rules/fusion/support_gain    " + toString(ParamValue(Rules().fusion.support_gain)) + " ";
  EXPECT_NE(list.find(line), std::string::npos) << line << list;
}

}  // namespace
}  // namespace dtsdf
