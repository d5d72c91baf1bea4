#include "tools/reconstruct_options.h"

#include "dtsdf_mapping/io/mesh_file.h"

namespace dtsdf {
namespace {

using ReconstructOption = Option<ReconstructOptions>;

std::string parseMeshPath(const std::string& path) {
  if (!meshFormatOf(path)) {
    throw UsageError("--mesh: '" + path + "' does not end in .ply, .obj or .stl");
  }
  return path;
}

std::vector<ReconstructOption> bagOptions() {
  return {{"--bag", "FILE", "ROS bag with depth images, camera_info and TF",
           [](auto& o, const auto& v) { o.bag_path = v; }},
          {"--depth-topic", "T", "the bag's depth images (default: the only such topic)",
           [](auto& o, const auto& v) { o.depth_topic = v; }},
          {"--info-topic", "T", "their camera_info (default: beside the depth topic)",
           [](auto& o, const auto& v) { o.info_topic = v; }}};
}

std::vector<ReconstructOption> meshOptions() {
  return {{"--mesh-every", "N", "extract the mesh each N frames as well; the result is the same",
           [](auto& o, const auto& v) { o.mesh_every = parseCount("--mesh-every", v, 1); }},
          {"--mesh", "OUT",
           "the mesh: .ply (normals, colours), .obj or .stl; missing folders are made",
           [](auto& o, const auto& v) { o.mesh_path = parseMeshPath(v); }}};
}

const std::vector<ReconstructOption>& allOptions() {
  static const std::vector<ReconstructOption> options = joinOptions<ReconstructOptions>(
      {tumOptions<ReconstructOptions>(), bagOptions(), frameOptions<ReconstructOptions>(),
       mapperOptions<ReconstructOptions>(), meshOptions(), reportOptions<ReconstructOptions>()});
  return options;
}

/// Rules between options.
void checkOptions(const ReconstructOptions& options, const std::set<std::string>& given) {
  if (options.tum_folder.empty() == options.bag_path.empty()) {
    throw UsageError("give either --tum DIR or --bag FILE");
  }
  for (const char* name : {"--depth-scale", "--pose-tolerance"}) {
    if (given.count(name) > 0 && options.tum_folder.empty()) {
      throw UsageError(std::string(name) + " is only for --tum");
    }
  }
  for (const char* name : {"--depth-topic", "--info-topic"}) {
    if (given.count(name) > 0 && options.bag_path.empty()) {
      throw UsageError(std::string(name) + " is only for --bag");
    }
  }
  if (options.mesh_path.empty()) throw UsageError("give --mesh OUT.ply, the file to write");
  if (options.mesh_path == options.report_path) {
    throw UsageError("--mesh and --report name the same file");
  }
}

}  // namespace

ReconstructOptions parseReconstructOptions(const std::vector<std::string>& arguments) {
  ReconstructOptions options;
  const std::set<std::string> given = parseOptions(arguments, allOptions(), options);
  if (!options.help) checkOptions(options, given);
  return options;
}

std::string reconstructHelp() {
  return "usage: reconstruct (--tum DIR | --bag FILE) [options] --mesh OUT.ply\n\n"
         "Fuses every depth image of a recording, without loss and with the same result each\n"
         "time, and saves the mesh.\n\n" +
         describeOptions(allOptions()) +
         "\nExit code: 0 the mesh is saved, 1 an error, 2 a wrong command line.\n";
}

}  // namespace dtsdf
