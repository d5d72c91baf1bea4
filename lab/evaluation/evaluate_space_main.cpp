/// evaluate_space: how far a map's answers about the space around surfaces are from the truth.

#include <cstdio>
#include <memory>
#include <stdexcept>

#include "dtsdf_mapping/io/recording.h"
#include "evaluation/shared_options.h"
#include "evaluation/space_figures.h"
#include "evaluation/space_picture.h"
#include "evaluation/space_scenes.h"
#include "io/atomic_file.h"
#include "program/progress_bar.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct EvaluateSpaceOptions {
  std::string tum_folder, mesh_path, seen_path, scene;
  std::string json_path, picture_path;
  ParamTree settings;
  size_t samples = 100000;
  double height_m = 0.5;
};

void addInputOptions(CommandLine& line, EvaluateSpaceOptions& options) {
  line.addText({"--tum", "DIR", "TUM folder with depth images and poses"}, options.tum_folder);
  line.addText({"--mesh", "MESH.ply", "the true mesh that the images show"}, options.mesh_path);
  line.addText({"--seen", "SEEN.ply",
                "the part of it that the images show, written by "
                "seen_surface"},
               options.seen_path);
  line.addText({"--scene", "NAME", "an analytic scene instead of these: shapes or room"},
               options.scene);
  line.requireOneOf({"--tum", "--scene"});
  line.onlyWith("--mesh", "--tum");
  line.onlyWith("--seen", "--tum");
}

EvaluateSpaceOptions readOptions(const std::vector<std::string>& arguments) {
  EvaluateSpaceOptions options;
  CommandLine line("evaluate_space", "--tum DIR --mesh MESH.ply --seen SEEN.ply [options]",
                   "Makes a map of images and compares its free space and distances with the "
                   "truth: errors of distances, cells that are called free but are not, and the "
                   "share of truly free cells that were found, as JSON.");
  addInputOptions(line, options);
  addSettingOption(line, options.settings);
  line.addWhole({"--samples", "N", "largest number of cells checked for each figure"},
                options.samples, {1, 1e9});
  line.addText({"--json", "FILE", "write the figures here (default: standard output)"},
               options.json_path);
  line.addText({"--picture", "OUT.png", "a slice of the map"}, options.picture_path);
  line.addNumber({"--height", "METRES", "height of the slice"}, options.height_m, {-1e3, 1e3});
  line.onlyWith("--height", "--picture");
  line.parse(arguments);
  if (!options.tum_folder.empty() && (options.mesh_path.empty() || options.seen_path.empty())) {
    throw UsageError("--tum needs --mesh and --seen, the truth");
  }
  return options;
}

/// What the map is made of, and held to.
struct Truth {
  Views views;
  std::unique_ptr<SpaceTruth> space;
};

void fuseRecording(const std::string& folder, Mapper& mapper) {
  RecordingOptions tum;
  tum.path = folder;
  tum.format = "tum";
  const auto frames = openRecording(tum);
  ProgressBar progress("frames", frames->size());
  size_t done = 0;
  while (const auto frame = frames->next()) {
    mapper.integrate(frame->depth);
    progress.show(++done);
  }
}

Truth fuse(const EvaluateSpaceOptions& options, Mapper& mapper) {
  if (!options.scene.empty()) {
    const ViewedScene viewed = viewedSceneFromName(options.scene);
    fuseScene(viewed, mapper);
    return {viewed.views, std::make_unique<SceneTruth>(viewed.scene, viewed.views)};
  }
  fuseRecording(options.tum_folder, mapper);
  return {readViews(options.tum_folder),
          std::make_unique<MeshTruth>(readPly(options.mesh_path), readPly(options.seen_path))};
}

void drawSlice(const EvaluateSpaceOptions& options, const MapperParams& params, const Space& space,
               const SpaceTruth& truth) {
  Eigen::AlignedBox3d bounds;
  for (const SpaceCell& known : space.cells()) {
    const Vec3i& c = known.cell;
    bounds.extend(space.cellSize_m() * Eigen::Vector3d(c.x, c.y, c.z));
    bounds.extend(space.cellSize_m() * Eigen::Vector3d(c.x + 1, c.y + 1, c.z + 1));
  }
  if (bounds.isEmpty()) throw std::runtime_error("the map has no known space to draw");
  bounds.min().z() = bounds.max().z() = options.height_m;
  constexpr double kPicturePixels = 1000.0;
  SliceOptions slice;
  slice.bounds_W = bounds;
  slice.pixel_m = bounds.sizes().maxCoeff() / kPicturePixels;
  slice.full_scale_m = static_cast<double>(params.space.max_distance_m);
  writeSlice(options.picture_path, space, truth, slice);
}

void evaluateSpace(const EvaluateSpaceOptions& options) {
  const MapperParams params = spaceParams(options.settings);
  const auto mapper = makeMapper(params);
  const Truth truth = fuse(options, *mapper);
  mapper->updateMesh();
  Space& space = *mapper->space();
  space.updateDistances();
  const SpaceQuestions questions{truth.views, static_cast<double>(params.space.max_distance_m),
                                 static_cast<double>(params.space.max_range_m), options.samples};
  const std::string json = toJson(measureSpace(space, *truth.space, questions));
  if (options.json_path.empty()) {
    std::fputs(json.c_str(), stdout);
  } else {
    writeFileAtomically(options.json_path, json);
  }
  if (!options.picture_path.empty()) drawSlice(options, params, space, *truth.space);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("evaluate_space", argc, argv, dtsdf::readOptions, dtsdf::evaluateSpace);
}
