/// evaluate_space: compares the free cells and distances of a map with the truth.

#include <cstdio>

#include "dtsdf_mapping/io/yaml_params.h"
#include "evaluation/space_figures.h"
#include "program/command_line.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct EvaluateSpaceOptions {
  ParamTree settings;
  size_t samples = 100000;
};

EvaluateSpaceOptions readOptions(const std::vector<std::string>& arguments) {
  EvaluateSpaceOptions options;
  CommandLine line(
      "evaluate_space", "[options]",
      "Maps rendered images of a room with shapes and compares the free cells and distances of the "
      "map with the truth. Prints, as JSON, errors in distances, the number of cells wrongly "
      "reported as free, and how many of the truly free cells were found.");
  line.addList({"--set", "KEY=VALUE ...", "settings of the map, as in config/default.yaml"},
               [&](const std::string& text) {
                 try {
                   setParam(text, options.settings);
                 } catch (const std::runtime_error& error) {
                   throw UsageError(error.what());
                 }
               });
  line.addNumber({"--samples", "N", "maximum number of cells sampled per metric"}, options.samples,
                 {1, 1e9});
  line.parse(arguments);
  return options;
}

void evaluateSpace(const EvaluateSpaceOptions& options) {
  const ViewedScene viewed = viewedShapes();
  ParamTree settings = options.settings;
  settings["space/enabled"] = true;
  const MapperParams params = readMapperParams(settings);
  const auto mapper = makeMapper(params);
  fuseScene(viewed, *mapper);
  mapper->updateMesh();
  Space& space = *mapper->space();
  space.updateDistances();
  const SpaceQuestions questions{static_cast<double>(params.space.max_distance_m),
                                 static_cast<double>(params.space.max_range_m), options.samples};
  std::fputs(toJson(measureSpace(space, SpaceTruth(viewed), questions)).c_str(), stdout);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("evaluate_space", argc, argv, dtsdf::readOptions, dtsdf::evaluateSpace);
}
