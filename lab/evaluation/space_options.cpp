#include "evaluation/space_options.h"

namespace dtsdf {

void addSettingOption(CommandLine& line, ParamTree& tree) {
  line.addList({"--set", "KEY=VALUE ...", "settings of the map, as in config/default.yaml"},
               [&](const std::string& text) {
                 try {
                   setParam(text, tree);
                 } catch (const std::runtime_error& error) {
                   throw UsageError(error.what());
                 }
               });
}

MapperParams spaceParams(ParamTree tree) {
  tree["space/enabled"] = true;
  return readMapperParams(tree);
}

}  // namespace dtsdf
