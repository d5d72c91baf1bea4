/// Tests that config/default.yaml equals the default values in the code, and that every file in
/// config/ can be loaded.
#include <gtest/gtest.h>

#include <filesystem>

#include "dtsdf_mapping/io/yaml_params.h"
#include "params/node_params.h"

namespace dtsdf {
namespace {

TEST(ConfigFiles, DefaultFileHasEveryDefault) {
  const ParamTree file = loadYamlParams(std::string(DTSDF_CONFIG_FOLDER) + "/default.yaml");
  const ParamTree expected = toTree(NodeParams());
  for (const auto& [key, value] : expected) {
    ASSERT_EQ(file.count(key), 1u) << key << " is missing";
    EXPECT_EQ(file.at(key), value) << key << ": " << toString(file.at(key)) << " in the file, "
                                   << toString(value) << " in the struct";
  }
  for (const auto& [key, value] : file) EXPECT_EQ(expected.count(key), 1u) << key;
}

TEST(ConfigFiles, EveryFileCanBeLoaded) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(DTSDF_CONFIG_FOLDER)) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(readNodeParams(loadYamlParams(entry.path().string()))) << entry.path();
    ++count;
  }
  EXPECT_GT(count, 0);
}

}  // namespace
}  // namespace dtsdf
