/// pass_plate: whether a plan leads through a thin plate that was seen from both sides.

#include <cmath>
#include <cstdio>

#include "evaluation/path_search.h"
#include "evaluation/shared_options.h"
#include "evaluation/space_picture.h"
#include "evaluation/space_scenes.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

/// Of the robot, around the middle of the corridor's height.
constexpr double kHalfHeight_m = 0.3;

struct PassPlateOptions {
  ParamTree settings;
  double thickness_m = 0.002, radius_m = 0.15;
  bool gap = false, through_unknown = false;
  std::string picture_path;
};

PassPlateOptions readOptions(const std::vector<std::string>& arguments) {
  PassPlateOptions options;
  CommandLine line("pass_plate", "[options]",
                   "Maps a closed corridor with a thin plate across its middle, seen from both "
                   "ends, and searches for a path through it by A*: over free cells farther from "
                   "all surfaces than a robot's radius, and over free columns of the ground grid "
                   "farther than that from all occupied ones. Prints both paths, or \"no way\", "
                   "and how many surface cells lie on the straight line from start to goal.");
  addSettingOption(line, options.settings);
  line.addNumber({"--thickness", "METRES", "of the plate"}, options.thickness_m, {1e-4, 1.0});
  line.addNumber({"--radius", "METRES", "of the robot"}, options.radius_m, {0.0, 1.0});
  line.addFlag("--gap", "leave a doorway beside the plate", options.gap);
  line.addFlag("--through-unknown", "let the robot pass unknown cells", options.through_unknown);
  line.addText({"--picture", "OUT.png", "the map from above, with the path"}, options.picture_path);
  line.parse(arguments);
  return options;
}

/// Of cells or columns, whose name says which.
void printWay(const char* name, const std::optional<Path>& way) {
  std::printf("%s: ", name);
  if (!way) {
    std::printf("no way\n");
    return;
  }
  std::printf("a way of %.2f m:", way->length_m);
  for (const Eigen::Vector3d& p : way->points_W) {
    std::printf(" (%.2f %.2f %.2f)", p.x(), p.y(), p.z());
  }
  std::printf("\n");
}

/// Along the straight line, which meets the plate only.
int countSurfaceCells(const Space& space) {
  const double step_m = space.cellSize_m();
  const int steps =
      static_cast<int>(std::ceil((corridorGoal().x() - corridorStart().x()) / step_m));
  int cells = 0;
  for (int i = 0; i < steps; ++i) {
    const Eigen::Vector3d p = corridorStart() + i * step_m * Eigen::Vector3d::UnitX();
    if (space.stateOf(space.cellAt(p)) == CellState::kSurface) ++cells;
  }
  return cells;
}

void passPlate(const PassPlateOptions& options) {
  const MapperParams params = spaceParams(options.settings);
  const auto mapper = makeMapper(params);
  const ViewedScene viewed = corridorWithPlate(options.thickness_m, options.gap);
  fuseScene(viewed, *mapper);
  mapper->updateMesh();
  Space& space = *mapper->space();
  space.updateDistances();
  const Passage passage{options.radius_m, options.through_unknown, corridorBounds()};
  const auto way = findPath(space, corridorStart(), corridorGoal(), passage);
  printWay("distances", way);
  printWay("grid", findPath(space, corridorStart(), corridorGoal(),
                            GroundPassage(space, {-kHalfHeight_m, kHalfHeight_m}, passage)));
  std::printf("%d cells with a surface on the straight line\n", countSurfaceCells(space));
  if (options.picture_path.empty()) return;
  SliceOptions slice;
  slice.bounds_W = corridorBounds();
  slice.pixel_m = 0.005;
  slice.full_scale_m = 1.0;
  if (way) slice.path_W = way->points_W;
  writeSlice(options.picture_path, space, SceneTruth(viewed.scene, viewed.views), slice);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("pass_plate", argc, argv, dtsdf::readOptions, dtsdf::passPlate);
}
