#include "tools/reconstruct_options.h"

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "params/text.h"
#include "tools/map_settings.h"

namespace dtsdf {
namespace {

void addInputOptions(CommandLine& line, ReconstructOptions& options) {
  RecordingOptions& recording = options.recording;
  line.addText({"INPUT", "",
                "a recording: a folder in one of the known formats, a ROS bag with "
                "depth images, camera_info and TF, or a journal"},
               recording.path);
  addFormatOption(line, options);
  addTumOption(line, options);
  line.add({"--bag", "FILE", "a ROS bag: the same as INPUT with --format bag"},
           [&](const std::string& value) {
             recording.path = value;
             recording.format = "bag";
           });
  line.requireOneOf({"INPUT", "--tum", "--bag"});
  line.onlyWith("--format", "INPUT");
}

void addMeshOptions(CommandLine& line, ReconstructOptions& options) {
  line.add({"--mesh-every", "N", "also extract the mesh every N frames; the result is the same"},
           [&](const std::string& value) {
             options.mesh_every = static_cast<size_t>(readWhole(value, {1, kUnbounded}));
           });
  line.add({"--mesh", "OUT",
            "mesh to write: .ply or .glb (normals, colours), .obj or .stl; folders are created"},
           [&](const std::string& value) {
             checkMeshPath(value);
             options.mesh_path = value;
           });
  addSimplifyOption(line, options.simplify_error_m);
}

void addPoseOptions(CommandLine& line, ReconstructOptions& options) {
  addSettingOption(
      line,
      {"--poses-mode", "tf|refine|track",
       "fuse images at the given poses (default with --poses or --only), align each to the map "
       "(default), or track the camera by the map alone, from the first pose"},
      "poses/mode", options);
  line.addText({"--poses-frame", "NAME",
                "for a journal: the frame in which --poses are given, its map frame (default) or "
                "its level frame"},
               options.poses_frame);
  line.onlyWith("--poses-frame", "--poses");
}

void addTrajectoryOption(CommandLine& line, ReconstructOptions& options) {
  line.addText({"--trajectory", "OUT.txt",
                "file to write, with the poses of the fused images: `stamp tx ty tz qx qy qz qw` "
                "per line, camera to map"},
               options.trajectory_path);
}

void addMapOptions(CommandLine& line, ReconstructOptions& options) {
  line.addText({"--load-map", "IN.dtsdf", "map to resume from; voxel size and mode come from it"},
               options.load_map_path);
  addSaveMapOption(line, "map to write", options.save_map_path);
  line.addText({"--only", "BOX",
                "build only one box of the map, in the form that map_tool boxes prints: "
                "x=FROM..TO,y=..,z=.. in metres; map_tool join joins the boxes"},
               options.only);
}

}  // namespace

ReconstructOptions parseReconstructOptions(const std::vector<std::string>& arguments) {
  ReconstructOptions options;
  CommandLine line(
      "reconstruct", "INPUT [options] --mesh OUT.ply",
      "Fuses the depth images of a recording and saves the mesh, the map or both. No image "
      "is dropped for lack of time, so results are reproducible. Example: "
      "reconstruct recording.bag --mesh kitchen.ply --set map/voxel_size_m=0.02");
  line.beginGroup("Input");
  addInputOptions(line, options);
  addReadingOptions(line, options);
  addFrameOptions(line, options);
  line.addFlag("--allow-gaps",
               "exit code 0 even if fewer than half of the images have a pose or are fused",
               options.allow_gaps);
  line.beginGroup("Settings");
  addMapperOptions(line, options);
  addPoseOptions(line, options);
  line.beginGroup("Output");
  addMeshOptions(line, options);
  addMapOptions(line, options);
  addTrajectoryOption(line, options);
  addReportOptions(line, options);
  line.parse(arguments);
  if (!options.only.empty() && (options.save_map_path.empty() || !options.mesh_path.empty() ||
                                !options.report_path.empty())) {
    throw UsageError(
        "--only saves a map: give --save-map, but neither --mesh nor --report; for a mesh, "
        "use map_tool join and then map_tool mesh");
  }
  if (options.mesh_path.empty() && options.save_map_path.empty() &&
      options.trajectory_path.empty()) {
    throw UsageError("--mesh, --save-map or --trajectory is required");
  }
  if (!options.mesh_path.empty() && options.mesh_path == options.report_path) {
    throw UsageError("--mesh and --report name the same file");
  }
  return options;
}

}  // namespace dtsdf
