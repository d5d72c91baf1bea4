#include "tools/reconstruct_options.h"

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <sstream>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/text_file.h"

namespace dtsdf {
namespace {

using Arguments = std::vector<std::string>;

struct Option {
  std::string name;   ///< With the dashes.
  std::string value;  ///< Name of its value in the help; empty for a flag.
  std::string help;
  std::function<void(ReconstructOptions&, const std::string&)> apply;
};

/// A whole number in [min, max].
size_t parseCount(const std::string& name, const std::string& text, size_t min) {
  long long number = 0;
  if (!parseNumber(text, number) || number < static_cast<long long>(min)) {
    throw UsageError(name + ": '" + text + "' is not a whole number from " + std::to_string(min) +
                     " on");
  }
  return static_cast<size_t>(number);
}

int parseThreads(const std::string& text) {
  int number = 0;
  if (!parseNumber(text, number) || number < 0) {
    throw UsageError("--threads: '" + text + "' is not a whole number from 0 on");
  }
  return number;
}

double parsePositive(const std::string& name, const std::string& text) {
  double number = 0.0;
  if (!parseNumber(text, number) || !std::isfinite(number) || !(number > 0.0)) {
    throw UsageError(name + ": '" + text + "' is not a number above 0");
  }
  return number;
}

std::string parseBackend(const std::string& text) {
  if (text != "auto" && text != "cpu" && text != "cuda") {
    throw UsageError("--backend: '" + text + "' is none of auto, cpu and cuda");
  }
  return text;
}

std::string parseMeshPath(const std::string& path) {
  if (!meshFormatOf(path)) {
    throw UsageError("--mesh: '" + path + "' does not end in .ply, .obj or .stl");
  }
  return path;
}

/// The form only: what the keys and values mean is told with the settings of the file.
std::string parseSetting(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw UsageError("--set: '" + text + "' is not of the form KEY=VALUE");
  }
  return text;
}

/// Breaks a text into indented lines for a terminal.
std::string wrap(const std::string& text) {
  constexpr size_t kColumns = 80;
  const std::string indent = "      ";
  std::istringstream words(text);
  std::string wrapped, line = indent;
  for (std::string word; words >> word;) {
    if (line.size() + word.size() > kColumns) {
      wrapped += line + "\n";
      line = indent;
    }
    line += (line == indent ? "" : " ") + word;
  }
  return wrapped + line + "\n";
}

std::vector<Option> inputOptions() {
  return {
      {"--tum", "DIR",
       "TUM RGB-D folder: depth.txt, groundtruth.txt (camera to world) and camera_info.yaml",
       [](auto& o, const auto& v) { o.tum_folder = v; }},
      {"--depth-scale", "UNITS", "units per metre of the folder's 16-bit images (default 5000)",
       [](auto& o, const auto& v) { o.units_per_metre = parsePositive("--depth-scale", v); }},
      {"--pose-tolerance", "SECONDS",
       "a frame is skipped if no pose is so near its stamp (default 0.02); between two poses it "
       "gets an interpolated one",
       [](auto& o, const auto& v) { o.pose_tolerance_s = parsePositive("--pose-tolerance", v); }},
      {"--bag", "FILE", "ROS bag with depth images, camera_info and TF",
       [](auto& o, const auto& v) { o.bag_path = v; }},
      {"--depth-topic", "T", "the bag's depth images (default: the only such topic)",
       [](auto& o, const auto& v) { o.depth_topic = v; }},
      {"--info-topic", "T", "their camera_info (default: beside the depth topic)",
       [](auto& o, const auto& v) { o.info_topic = v; }},
      {"--frames", "FIRST:LAST:STEP",
       "depth images to use, by index from 0 on: FIRST, FIRST+STEP, ... up to and with LAST; "
       "parts may be left out, as in 100:, :99 or ::2",
       [](auto& o, const auto& v) { o.frames = parseFrameSelection(v); }}};
}

std::vector<Option> otherOptions() {
  return {
      {"--config", "FILE", "settings as in config/default.yaml (default: the built-in defaults)",
       [](auto& o, const auto& v) { o.config_path = v; }},
      {"--set", "KEY=VALUE ...", "single settings, over those of the file; may be repeated",
       [](auto& o, const auto& v) { o.settings.push_back(parseSetting(v)); }},
      {"--backend", "auto|cpu|cuda", "where to compute, over the setting `backend`",
       [](auto& o, const auto& v) { o.backend = parseBackend(v); }},
      {"--threads", "N", "CPU threads (0: all cores), over the setting `threads`",
       [](auto& o, const auto& v) { o.threads = parseThreads(v); }},
      {"--mesh-every", "N", "extract the mesh each N frames as well; the result is the same",
       [](auto& o, const auto& v) { o.mesh_every = parseCount("--mesh-every", v, 1); }},
      {"--mesh", "OUT", "the mesh: .ply (normals, colours), .obj or .stl; missing folders are made",
       [](auto& o, const auto& v) { o.mesh_path = parseMeshPath(v); }},
      {"--report", "OUT.json", "times and counts",
       [](auto& o, const auto& v) { o.report_path = v; }},
      {"--help", "", "show this and end", [](auto& o, const auto&) { o.help = true; }}};
}

const std::vector<Option>& allOptions() {
  static const std::vector<Option> options = [] {
    std::vector<Option> all = inputOptions();
    for (Option& option : otherOptions()) all.push_back(std::move(option));
    return all;
  }();
  return options;
}

const Option& findOption(const std::string& name) {
  for (const Option& option : allOptions()) {
    if (option.name == name) return option;
  }
  if (name.rfind("-", 0) != 0) throw UsageError("'" + name + "' belongs to no option");
  throw UsageError("unknown option " + name);
}

bool isOption(const std::string& argument) { return argument.rfind("--", 0) == 0; }

/// Applies the option at `index` with its value and moves on behind them.
void parseOne(const Arguments& arguments, size_t& index, ReconstructOptions& options,
              std::set<std::string>& given) {
  const std::string& argument = arguments[index++];
  const size_t equals = isOption(argument) ? argument.find('=') : std::string::npos;
  const Option& option = findOption(argument == "-h" ? "--help" : argument.substr(0, equals));
  const bool is_list = option.name == "--set";
  if (!given.insert(option.name).second && !is_list) {
    throw UsageError(option.name + " is given twice");
  }
  if (option.value.empty()) {
    if (equals != std::string::npos) throw UsageError(option.name + " takes no value");
    option.apply(options, "");
    return;
  }
  std::string value;
  if (equals != std::string::npos) {
    value = argument.substr(equals + 1);
  } else if (index < arguments.size() && !isOption(arguments[index])) {
    value = arguments[index++];
  }
  if (value.empty()) throw UsageError(option.name + " needs a value (" + option.value + ")");
  option.apply(options, value);
  while (is_list && index < arguments.size() && !isOption(arguments[index])) {
    option.apply(options, arguments[index++]);
  }
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

FrameSelection parseFrameSelection(const std::string& text) {
  FrameSelection selection;
  size_t* const parts[] = {&selection.first, &selection.last, &selection.step};
  size_t begin = 0;
  for (size_t i = 0; i < 3; ++i) {
    const size_t colon = text.find(':', begin);
    const std::string part = text.substr(begin, colon - begin);
    if (!part.empty()) *parts[i] = parseCount("--frames", part, i == 2 ? 1 : 0);
    if (colon == std::string::npos) {
      if (i == 0) break;  // no colon at all
      if (selection.first > selection.last) {
        throw UsageError("--frames: LAST comes before FIRST in '" + text + "'");
      }
      return selection;
    }
    begin = colon + 1;
  }
  throw UsageError("--frames: '" + text + "' is not of the form FIRST:LAST:STEP");
}

ReconstructOptions parseReconstructOptions(const Arguments& arguments) {
  ReconstructOptions options;
  std::set<std::string> given;
  for (size_t index = 0; index < arguments.size();) {
    parseOne(arguments, index, options, given);
    if (options.help) return options;
  }
  checkOptions(options, given);
  return options;
}

std::string reconstructHelp() {
  std::string text =
      "usage: reconstruct (--tum DIR | --bag FILE) [options] --mesh OUT.ply\n\n"
      "Fuses every depth image of a recording, without loss and with the same result each time,\n"
      "and saves the mesh.\n\n";
  for (const Option& option : allOptions()) {
    text += "  " + option.name + (option.value.empty() ? "" : " " + option.value) + "\n" +
            wrap(option.help);
  }
  return text + "\nExit code: 0 the mesh is saved, 1 an error, 2 a wrong command line.\n";
}

}  // namespace dtsdf
