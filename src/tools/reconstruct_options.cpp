#include "tools/reconstruct_options.h"

#include "dtsdf_mapping/io/mesh_file.h"

namespace dtsdf {
namespace {

std::string parseMeshPath(const std::string& path) {
  if (!meshFormatOf(path)) throw UsageError("'" + path + "' does not end in .ply, .obj or .stl");
  return path;
}

void addBagOptions(CommandLine& line, ReconstructOptions& options) {
  line.addText({"--bag", "FILE", "ROS bag with depth images, camera_info and TF"},
               options.bag_path);
  line.addText({"--depth-topic", "T", "the bag's depth images (default: the only such topic)"},
               options.depth_topic);
  line.addText({"--info-topic", "T", "their camera_info (default: beside the depth topic)"},
               options.info_topic);
  line.onlyWith("--depth-topic", "--bag");
  line.onlyWith("--info-topic", "--bag");
}

void addMeshOptions(CommandLine& line, ReconstructOptions& options) {
  line.add({"--mesh-every", "N", "extract the mesh each N frames as well; the result is the same"},
           [&](const std::string& value) {
             options.mesh_every = static_cast<size_t>(readWhole(value, {1, kUnbounded}));
           });
  line.add({"--mesh", "OUT",
            "the mesh: .ply (normals, colours), .obj or .stl; missing folders are made"},
           [&](const std::string& value) { options.mesh_path = parseMeshPath(value); });
  line.require("--mesh");
}

}  // namespace

ReconstructOptions parseReconstructOptions(const std::vector<std::string>& arguments) {
  ReconstructOptions options;
  CommandLine line("reconstruct", "(--tum DIR | --bag FILE) [options] --mesh OUT.ply",
                   "Fuses every depth image of a recording, without loss and with the same result "
                   "each time, and saves the mesh.",
                   "Exit code: 0 the mesh is saved, 1 an error, 2 a wrong command line.");
  line.beginGroup("Input");
  addTumOptions(line, options);
  addBagOptions(line, options);
  addFrameOptions(line, options);
  line.requireOneOf({"--tum", "--bag"});
  line.beginGroup("Settings");
  addMapperOptions(line, options);
  line.beginGroup("Output");
  addMeshOptions(line, options);
  addReportOptions(line, options);
  line.parse(arguments);
  if (options.mesh_path == options.report_path) {
    throw UsageError("--mesh and --report name the same file");
  }
  return options;
}

}  // namespace dtsdf
