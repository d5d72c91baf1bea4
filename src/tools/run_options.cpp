#include "tools/run_options.h"

#include <algorithm>
#include <sstream>
#include <utility>
#include <vector>

#include "backend/rules.h"
#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/io/yaml_params.h"
#include "io/pose_files.h"
#include "params/node_params.h"
#include "params/setting_unit.h"
#include "params/text.h"

namespace dtsdf {
namespace {

/// One line per setting: key, default, unit and range.
std::string listOf(const ParamWriter& written) {
  std::string text;
  for (const auto& [key, value] : written.tree) {
    const std::string unit = unitOf(key);
    text += formatted("%-28s %-20s %s\n", key.c_str(),
                      (toString(value) + (unit.empty() ? "" : " " + unit)).c_str(),
                      written.choices.at(key).c_str());
  }
  return text;
}

}  // namespace

std::string listSettings() {
  NodeParams params;
  ParamWriter writer;
  visitParams(params, writer);
  return listOf(writer);
}

std::string listRules() {
  Rules rules;
  ParamWriter writer;
  visitRules(rules, writer);
  return listOf(writer);
}

namespace {

/// Checks only the syntax; keys and values are checked later, together with those of the file.
std::string parseSetting(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw UsageError("'" + text + "' is not of the form KEY=VALUE");
  }
  return text;
}

}  // namespace

FrameSelection parseFrameSelection(const std::string& text) {
  FrameSelection selection;
  size_t* const numbers[] = {&selection.first, &selection.last, &selection.step};
  size_t count = 0;
  std::istringstream parts(text + ":");  // so that an empty last part counts, too
  for (std::string part; count < 4 && std::getline(parts, part, ':'); ++count) {
    if (part.empty() || count == 3) continue;
    *numbers[count] = static_cast<size_t>(readWhole(part, {count == 2 ? 1.0 : 0.0, kUnbounded}));
  }
  if (count > 3 || text.find(':') == std::string::npos) {
    throw UsageError("'" + text + "' is not of the form FIRST:LAST:STEP; use N:N for one image");
  }
  if (selection.first <= selection.last) return selection;
  throw UsageError("LAST comes before FIRST in '" + text + "'");
}

void addTumOption(CommandLine& line, RunOptions& options) {
  line.add({"--tum", "DIR",
            "TUM RGB-D folder: depth.txt, groundtruth.txt (camera to world) and camera_info.yaml "
            "(optional for the benchmark's own recordings)"},
           [&](const std::string& value) {
             options.recording.path = value;
             options.recording.format = "tum";
           });
}

void addFolderOptions(CommandLine& line, RunOptions& options) {
  line.add({"--depth-scale", "UNITS",
            "units per metre of a folder's 16-bit images (default: tum and icl 5000, 7scenes, "
            "scannet and png 1000, replica as in cam_params.json)"},
           [&](const std::string& value) {
             options.recording.units_per_metre = readNumber(value, {kAboveZero, kUnbounded});
           });
  line.addNumber({"--pose-tolerance", "SECONDS",
                  "maximum time between an image and the nearest pose; images farther from any "
                  "pose are skipped, and poses of all others are interpolated"},
                 options.recording.pose_tolerance_s, {kAboveZero, kUnbounded});
}

void addFrameOptions(CommandLine& line, RunOptions& options) {
  line.add(
      {"--frames", "FIRST:LAST:STEP",
       "depth images to use, counted from 0, LAST included; parts may be left out: 100:, :99, ::2"},
      [&](const std::string& value) { options.recording.selection = parseFrameSelection(value); });
}

void addMapperOptions(CommandLine& line, RunOptions& options) {
  line.addText(
      {"--config", "FILE", "settings as in config/default.yaml (default: the built-in defaults)"},
      options.config_path);
  line.addList({"--set", "KEY=VALUE ...",
                "single settings, which override those of the file; may be repeated. Keys that "
                "start with rules/ change rule parameters, for experiments"},
               [&](const std::string& value) { options.settings.push_back(parseSetting(value)); });
  line.addTextRequest("--list-settings", "print every setting with its default, unit and range",
                      [] { return listSettings(); });
  line.addTextRequest("--list-rules", "print every rule parameter with its default and range",
                      [] { return listRules(); });
  addSettingOption(line, {"--backend", "auto|cpu|cuda", "device to compute on"}, "backend",
                   options);
  addSettingOption(line, {"--threads", "N", "CPU threads (0: all cores)"}, "threads", options);
}

void addSettingOption(CommandLine& line, ProgramOption option, const std::string& key,
                      RunOptions& options) {
  option.help += "; overrides the setting `" + key + "`";
  line.add(std::move(option), [&options, key](const std::string& value) {
    options.settings.push_back(key + "=" + value);
  });
}

void addSaveMapOption(CommandLine& line, const std::string& help, std::string& path) {
  line.add({"--save-map", "OUT.dtsdf", help}, [&](const std::string& value) {
    if (!hasEnding(value, kMapExtension)) {
      throw UsageError("'" + value + "' does not end in " + kMapExtension);
    }
    path = value;
  });
}

void addReportOptions(CommandLine& line, RunOptions& options) {
  line.addText({"--report", "OUT.json", "times and counts"}, options.report_path);
}

RunSettings readSettings(const RunOptions& options) { return readSettings(options, {}); }

RunSettings readSettings(const RunOptions& options, ParamTree defaults) {
  ParamTree tree = std::move(defaults);
  if (!options.config_path.empty()) {
    for (auto& [key, value] : loadYamlParams(options.config_path)) tree[key] = value;
  }
  for (const std::string& setting : options.settings) setParam(setting, tree);
  return readSettings(std::move(tree));
}

RunSettings readSettings(ParamTree tree) {
  RunSettings settings;
  settings.given = tree;
  ParamReader reader(std::move(tree));
  visitParams(settings.params, reader);
  visitRules(settings.rules, reader);
  checkParams(settings.params.mapper, reader);
  readFrames(settings.params, reader);
  reader.finish();
  resolveMemoryFrames(settings.params.poses, settings.params.mapper.fusion);
  return settings;
}

namespace {

Intrinsics parseIntrinsics(const std::string& text) {
  const std::vector<double> numbers = readNumbers(text);
  if (numbers.size() != 4 || numbers[0] <= 0.0 || numbers[1] == 0.0) {
    throw UsageError("'" + text + "' is not of the form fx,fy,cx,cy, with fx above 0 and fy not 0");
  }
  const auto pixels = [&](size_t i) { return static_cast<float>(numbers[i]); };
  return {pixels(0), pixels(1), pixels(2), pixels(3)};
}

}  // namespace

void addFormatOption(CommandLine& line, RunOptions& options) {
  std::vector<std::string> formats = recordingFormats();
  formats.insert(formats.end(), {"bag", "journal"});
  line.add({"--format", joined(formats, "|"), "format of the recording (default: detected)"},
           [&options, formats](const std::string& value) {
             if (std::find(formats.begin(), formats.end(), value) == formats.end()) {
               throw UsageError("'" + value + "' is not " + joined(formats, ", ", " or "));
             }
             options.recording.format = value;
           });
}

void addReadingOptions(CommandLine& line, RunOptions& options) {
  BagOptions& recording = options.recording;
  line.add({"--intrinsics", "FX,FY,CX,CY",
            "intrinsics in pixels, instead of the recording's; a negative FY flips the rows of a "
            "folder's images, for cameras whose y axis points up"},
           [&](const std::string& value) { recording.intrinsics = parseIntrinsics(value); });
  line.addText(
      {"--poses", "FILE",
       "poses to use instead of the recording's, in metres: lines `stamp tx ty tz qx qy qz qw` "
       "(TUM); for folders also lines of 12 (KITTI) or 16 numbers, Open3D's "
       "trajectory.log, COLMAP's images.txt, transforms.json, or a folder of .txt "
       "files with 4 x 4 numbers each. For a journal: corrected poses of some of its images; "
       "the corrections of all others are interpolated"},
      recording.poses_path);
  line.add(
      {"--pose-convention", "optical|opengl|body|inverted",
       "what the poses describe: a camera with z forward, with y up and z backwards, or with "
       "x forward and z up; or the transform from map to camera (default: inverted for COLMAP, "
       "opengl for transforms.json, else optical)"},
      [&](const std::string& value) {
        opticalPose(Eigen::Isometry3d::Identity(), value);  // throws
        recording.pose_convention = value;
      });
  line.addFlag("--skip-bad", "skip images that cannot be decoded, and count them",
               recording.skip_bad);
  addFolderOptions(line, options);
  line.addText({"--depth-topic", "T", "a bag's depth images (default: the only such topic)"},
               recording.depth_topic);
  line.addText({"--info-topic", "T", "camera_info of a bag's depth images (default: next to them)"},
               recording.info_topic);
  line.addText({"--mask-topic", "T",
                "a bag's masks: mono8, nonzero for pixels to ignore, such as people or the robot "
                "(default: none)"},
               recording.mask_topic);
  line.addText({"--color-topic", "T",
                "a bag's colour images, with camera_info next to them (default: the only such "
                "topic)"},
               recording.colour_topic);
  line.addText({"--tf-topic", "T", "a bag's transforms; static ones on T_static (default: /tf)"},
               recording.tf_topic);
  line.addText({"--imu-topic", "T",
                "a bag's sensor_msgs/Imu for map/level: imu (default: the only such topic)"},
               recording.imu_topic);
}

void checkReadingOptions(const RunOptions& options) {
  const BagOptions& recording = options.recording;
  const bool is_bag = recording.format == "bag";
  const std::string read_as = "'" + recording.path + "' is read as " + recording.format;
  if (is_bag && recording.units_per_metre) {
    throw UsageError("--depth-scale is for folders, and " + read_as +
                     "; a bag's units are the settings input/unit_16uc1_m and unit_32fc1_m");
  }
  if (is_bag && recording.intrinsics && recording.intrinsics->fy < 0.0f) {
    throw UsageError("--intrinsics: a negative FY is for folders, and " + read_as);
  }
  const std::pair<const char*, const std::string&> topics[] = {
      {"--depth-topic", recording.depth_topic}, {"--info-topic", recording.info_topic},
      {"--mask-topic", recording.mask_topic},   {"--color-topic", recording.colour_topic},
      {"--tf-topic", recording.tf_topic},       {"--imu-topic", recording.imu_topic}};
  const BagOptions unset;
  const FrameSelection &frames = recording.selection, &all = unset.selection;
  const std::pair<const char*, bool> of_recordings[] = {
      {"--frames", frames.first > 0 || frames.last < all.last || frames.step > 1},
      {"--intrinsics", recording.intrinsics.has_value()},
      {"--depth-scale", recording.units_per_metre.has_value()},
      {"--pose-convention", !recording.pose_convention.empty()},
      {"--pose-tolerance", recording.pose_tolerance_s != unset.pose_tolerance_s},
      {"--skip-bad", recording.skip_bad}};
  const auto refuse = [&](const std::string& option, const char* inputs) {
    throw UsageError(option + " is for " + inputs + ", and " + read_as);
  };
  for (const auto& [option, topic] : topics) {
    if (!is_bag && !topic.empty()) refuse(option, "bags");
  }
  for (const auto& [option, is_given] : of_recordings) {
    if (recording.format == "journal" && is_given) refuse(option, "recordings");
  }
}

}  // namespace dtsdf
