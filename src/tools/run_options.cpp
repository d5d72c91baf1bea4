#include "tools/run_options.h"

#include <utility>

#include "dtsdf_mapping/io/yaml_params.h"
#include "tools/setting_list.h"

namespace dtsdf {
namespace {

std::string parseBackend(const std::string& text) {
  if (text != "auto" && text != "cpu" && text != "cuda") {
    throw UsageError("'" + text + "' is not auto, cpu or cuda");
  }
  return text;
}

/// The form only: keys and values are checked together with those of the file.
std::string parseSetting(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw UsageError("'" + text + "' is not of the form KEY=VALUE");
  }
  return text;
}

/// "5-10" is what many people type.
void checkNotDashed(const std::string& text) {
  const size_t dash = text.find('-', 1);
  if (dash == std::string::npos || text.find(':') != std::string::npos) return;
  throw UsageError("'" + text + "' is not of the form FIRST:LAST:STEP; give " +
                   text.substr(0, dash) + ":" + text.substr(dash + 1));
}

}  // namespace

FrameSelection parseFrameSelection(const std::string& text) {
  checkNotDashed(text);
  FrameSelection selection;
  size_t* const parts[] = {&selection.first, &selection.last, &selection.step};
  size_t begin = 0;
  for (size_t i = 0; i < 3; ++i) {
    const size_t colon = text.find(':', begin);
    const std::string part = text.substr(begin, colon - begin);
    if (!part.empty()) {
      *parts[i] = static_cast<size_t>(readWhole(part, {i == 2 ? 1.0 : 0.0, kUnbounded}));
    }
    if (colon == std::string::npos) {
      if (i == 0) break;  // no colon at all
      if (selection.first > selection.last) {
        throw UsageError("LAST comes before FIRST in '" + text + "'");
      }
      return selection;
    }
    begin = colon + 1;
  }
  throw UsageError("'" + text + "' is not of the form FIRST:LAST:STEP; one image is N:N");
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
            "units per metre of a folder's 16-bit images (default: tum and icl 5000, 7scenes and "
            "scannet 1000, replica as in cam_params.json)"},
           [&](const std::string& value) {
             options.recording.units_per_metre = readNumber(value, {kAboveZero, kUnbounded});
           });
  line.addNumber({"--pose-tolerance", "SECONDS",
                  "largest time between an image and the nearest pose; images without one are "
                  "skipped, others get an interpolated pose"},
                 options.recording.pose_tolerance_s, {kAboveZero, kUnbounded});
}

void addFrameOptions(CommandLine& line, RunOptions& options) {
  line.add(
      {"--frames", "FIRST:LAST:STEP",
       "depth images to use, counted from 0, LAST included; parts may be left out: 100:, :99, "
       "::2"},
      [&](const std::string& value) { options.recording.selection = parseFrameSelection(value); });
}

void addMapperOptions(CommandLine& line, RunOptions& options) {
  line.addText(
      {"--config", "FILE", "settings as in config/default.yaml (default: the built-in defaults)"},
      options.config_path);
  line.addList({"--set", "KEY=VALUE ...",
                "single settings, which override those of the file; may be repeated. Keys that "
                "start with rules/ change numbers of the method, for experiments"},
               [&](const std::string& value) { options.settings.push_back(parseSetting(value)); });
  line.addTextRequest("--list-settings", "print every setting with its default, unit and range",
                      [] { return listSettings(); });
  line.addTextRequest("--list-rules", "print the keys under rules/ with their defaults and ranges",
                      [] { return listRules(); });
  line.add({"--backend", "auto|cpu|cuda", "where to compute; overrides the setting `backend`"},
           [&](const std::string& value) { options.backend = parseBackend(value); });
  line.add({"--threads", "N", "CPU threads (0: all cores); overrides the setting `threads`"},
           [&](const std::string& value) {
             options.threads = static_cast<int>(readWhole(value, {0, 1024}));
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
  if (options.backend) tree["backend"] = *options.backend;
  if (options.poses_mode) tree["poses/mode"] = *options.poses_mode;
  if (options.threads) tree["threads"] = *options.threads;
  return readSettings(std::move(tree));
}

RunSettings readSettings(ParamTree tree) {
  RunSettings settings;
  settings.given = tree;
  ParamReader reader(std::move(tree));
  visitParams(settings.params, reader);
  visitRules(settings.rules, reader);
  checkParams(settings.params.mapper, reader);
  readFrames(settings.params.node, reader);
  reader.finish();
  return settings;
}

}  // namespace dtsdf
