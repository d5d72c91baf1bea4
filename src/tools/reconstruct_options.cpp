#include "tools/reconstruct_options.h"

#include <algorithm>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/simplify.h"

namespace dtsdf {
namespace {

std::string parseMeshPath(const std::string& path) {
  if (!meshFormatOf(path)) {
    throw UsageError("'" + path + "' does not end in " + kMeshExtensions);
  }
  return path;
}

/// The formats' names, "bag" included.
std::vector<std::string> formatNames() {
  std::vector<std::string> names = recordingFormats();
  names.push_back("bag");
  return names;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : "|") + name;
  return text;
}

std::string parseFormat(const std::string& text) {
  const std::vector<std::string> names = formatNames();
  if (std::find(names.begin(), names.end(), text) == names.end()) {
    throw UsageError("'" + text + "' is none of " + joined(names));
  }
  return text;
}

Intrinsics parseIntrinsics(const std::string& text) {
  const std::vector<double> numbers = readNumbers(text);
  if (numbers.size() != 4 || numbers[0] <= 0.0 || numbers[1] == 0.0) {
    throw UsageError("'" + text + "' is not of the form fx,fy,cx,cy, with fx above 0 and fy not 0");
  }
  const auto pixels = [&](size_t i) { return static_cast<float>(numbers[i]); };
  return {pixels(0), pixels(1), pixels(2), pixels(3)};
}

void addInputOptions(CommandLine& line, ReconstructOptions& options) {
  RecordingOptions& recording = options.recording;
  line.addText({"INPUT", "", "a recording: a folder as it is downloaded, or a ROS bag with depth "
                "images, camera_info and TF"}, recording.path);
  line.add({"--format", joined(formatNames()), "what INPUT is (default: guessed from what lies "
            "there)"},
           [&](const std::string& value) { recording.format = parseFormat(value); });
  addTumOption(line, options);
  line.add({"--bag", "FILE", "a ROS bag: the same as INPUT with --format bag"},
           [&](const std::string& value) {
             recording.path = value;
             recording.format = "bag";
           });
  line.requireOneOf({"INPUT", "--tum", "--bag"});
  line.onlyWith("--format", "INPUT");
}

void addReadingOptions(CommandLine& line, ReconstructOptions& options) {
  RecordingOptions& recording = options.recording;
  line.add({"--intrinsics", "FX,FY,CX,CY",
            "the camera in pixels, in place of what the recording tells; a negative FY flips the "
            "rows of a folder's images, for cameras whose y axis points up"},
           [&](const std::string& value) { recording.intrinsics = parseIntrinsics(value); });
  line.addText({"--poses", "FILE",
                "poses in place of the recording's: a line `stamp tx ty tz qx qy qz qw` each, "
                "camera to world; images without stamps have their number for one"},
               recording.poses_path);
  addFolderOptions(line, options);
  line.addText({"--depth-topic", "T", "a bag's depth images (default: the only such topic)"},
               options.depth_topic);
  line.addText({"--info-topic", "T", "their camera_info (default: beside the depth topic)"},
               options.info_topic);
  line.addText({"--mask-topic", "T",
                "a bag's masks: mono8, not 0 where the image shows what is no part of the scene"},
               options.mask_topic);
  line.addText({"--color-topic", "T",
                "a bag's colour images, with camera_info beside them (default: the only such "
                "topic)"},
               options.colour_topic);
}

void addMeshOptions(CommandLine& line, ReconstructOptions& options) {
  line.add({"--mesh-every", "N", "extract the mesh each N frames as well; the result is the same"},
           [&](const std::string& value) {
             options.mesh_every = static_cast<size_t>(readWhole(value, {1, kUnbounded}));
           });
  line.add({"--mesh", "OUT",
            "the mesh: .ply or .glb (normals, colours), .obj or .stl; missing folders are made"},
           [&](const std::string& value) { options.mesh_path = parseMeshPath(value); });
  line.addNumber({"--simplify-error", "METRES",
                  "save fewer triangles, no farther than that from the mesh; the distance that "
                  "came out is told"},
                 options.simplify_error_m, {kAboveZero, kUnbounded});
}

std::string parseMapPath(const std::string& path) {
  const std::string extension = kMapExtension;
  if (path.size() <= extension.size() ||
      path.compare(path.size() - extension.size(), extension.size(), extension) != 0) {
    throw UsageError("'" + path + "' does not end in " + extension);
  }
  return path;
}

void addMapOptions(CommandLine& line, ReconstructOptions& options) {
  line.addText({"--load-map", "IN.dtsdf",
                "a map to go on with, as the run that saved it would have; its settings hold where "
                "none are given"},
               options.load_map_path);
  line.add({"--save-map", "OUT.dtsdf", "the map, to be gone on with; --mesh may be left out then"},
           [&](const std::string& value) { options.save_map_path = parseMapPath(value); });
}

}  // namespace

ReconstructOptions parseReconstructOptions(const std::vector<std::string>& arguments) {
  ReconstructOptions options;
  CommandLine line("reconstruct", "INPUT [options] --mesh OUT.ply",
                   "Fuses every depth image of a recording, without loss and with the same result "
                   "each time, and saves the mesh, the map or both.",
                   "Exit code: 0 all is saved, 1 an error, 2 a wrong command line.");
  line.beginGroup("Input");
  addInputOptions(line, options);
  addReadingOptions(line, options);
  addFrameOptions(line, options);
  line.beginGroup("Settings");
  addMapperOptions(line, options);
  line.beginGroup("Output");
  addMeshOptions(line, options);
  addMapOptions(line, options);
  addReportOptions(line, options);
  line.parse(arguments);
  if (options.simplify_error_m > 0.0 && !canSimplify()) {
    throw UsageError("--simplify-error needs meshoptimizer (libmeshoptimizer-dev, from Debian 12 "
                     "and Ubuntu 22.04 on), which this build was made without");
  }
  if (options.mesh_path.empty() && options.save_map_path.empty()) {
    throw UsageError("--mesh is required");
  }
  if (!options.mesh_path.empty() && options.mesh_path == options.report_path) {
    throw UsageError("--mesh and --report name the same file");
  }
  return options;
}

void checkReadingOptions(const ReconstructOptions& options) {
  const RecordingOptions& recording = options.recording;
  const bool is_bag = recording.format == "bag";
  const std::string read_as = "'" + recording.path + "' is read as " + recording.format;
  if (is_bag && recording.units_per_metre) {
    throw UsageError("--depth-scale is for folders, and " + read_as +
                     "; a bag's units are the settings input/unit_16uc1_m and unit_32fc1_m");
  }
  if (is_bag && recording.intrinsics && recording.intrinsics->fy < 0.0f) {
    throw UsageError("--intrinsics: a negative FY is for folders, and " + read_as);
  }
  if (!is_bag && !options.depth_topic.empty()) {
    throw UsageError("--depth-topic is for bags, and " + read_as);
  }
  if (!is_bag && !options.info_topic.empty()) {
    throw UsageError("--info-topic is for bags, and " + read_as);
  }
  if (!is_bag && !options.mask_topic.empty()) {
    throw UsageError("--mask-topic is for bags, and " + read_as);
  }
  if (!is_bag && !options.colour_topic.empty()) {
    throw UsageError("--color-topic is for bags, and " + read_as);
  }
}

}  // namespace dtsdf
