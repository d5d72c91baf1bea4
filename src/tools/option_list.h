/// Command lines of the programs that fuse frames: a list of options, and those that all share.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// The command line is wrong; the program ends with exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What the programs have in common.
struct RunOptions {
  std::string tum_folder;
  double units_per_metre = 5000.0;  ///< Of TUM depth images.
  double pose_tolerance_s = 0.02;   ///< For TUM folders.
  FrameSelection frames;
  std::string config_path;
  std::vector<std::string> settings;  ///< Each key=value, in the order given.
  std::optional<std::string> backend;
  std::optional<int> threads;
  std::string report_path;
  bool help = false;
};

/// An option of a program whose command line is read into an Options.
template <class Options>
struct Option {
  std::string name;   ///< With the dashes.
  std::string value;  ///< Name of its value in the help; empty for a flag.
  std::string help;
  std::function<void(Options&, const std::string&)> apply;
};

/// A whole number from `min` on. These throw UsageError with the option's name.
size_t parseCount(const std::string& name, const std::string& text, size_t min);
int parseThreads(const std::string& text);
double parsePositive(const std::string& name, const std::string& text);
std::string parseBackend(const std::string& text);
std::string parseSetting(const std::string& text);

/// FIRST:LAST:STEP; each part, and colons at the end, may be left out.
/// @throws UsageError
FrameSelection parseFrameSelection(const std::string& text);

/// Breaks a text into indented lines for a terminal.
std::string wrapHelp(const std::string& text);

template <class Options>
std::vector<Option<Options>> tumOptions() {
  return {
      {"--tum", "DIR",
       "TUM RGB-D folder: depth.txt, groundtruth.txt (camera to world) and camera_info.yaml",
       [](auto& o, const auto& v) { o.tum_folder = v; }},
      {"--depth-scale", "UNITS", "units per metre of the folder's 16-bit images (default 5000)",
       [](auto& o, const auto& v) { o.units_per_metre = parsePositive("--depth-scale", v); }},
      {"--pose-tolerance", "SECONDS",
       "a frame is skipped if no pose is so near its stamp (default 0.02); between two poses it "
       "gets an interpolated one",
       [](auto& o, const auto& v) { o.pose_tolerance_s = parsePositive("--pose-tolerance", v); }}};
}

template <class Options>
std::vector<Option<Options>> frameOptions() {
  return {{"--frames", "FIRST:LAST:STEP",
           "depth images to use, by index from 0 on: FIRST, FIRST+STEP, ... up to and with LAST; "
           "parts may be left out, as in 100:, :99 or ::2",
           [](auto& o, const auto& v) { o.frames = parseFrameSelection(v); }}};
}

template <class Options>
std::vector<Option<Options>> mapperOptions() {
  return {
      {"--config", "FILE", "settings as in config/default.yaml (default: the built-in defaults)",
       [](auto& o, const auto& v) { o.config_path = v; }},
      {"--set", "KEY=VALUE ...", "single settings, over those of the file; may be repeated",
       [](auto& o, const auto& v) { o.settings.push_back(parseSetting(v)); }},
      {"--backend", "auto|cpu|cuda", "where to compute, over the setting `backend`",
       [](auto& o, const auto& v) { o.backend = parseBackend(v); }},
      {"--threads", "N", "CPU threads (0: all cores), over the setting `threads`",
       [](auto& o, const auto& v) { o.threads = parseThreads(v); }}};
}

template <class Options>
std::vector<Option<Options>> reportOptions() {
  return {{"--report", "OUT.json", "times and counts",
           [](auto& o, const auto& v) { o.report_path = v; }},
          {"--help", "", "show this and end", [](auto& o, const auto&) { o.help = true; }}};
}

template <class Options>
std::vector<Option<Options>> joinOptions(
    const std::vector<std::vector<Option<Options>>>& parts) {
  std::vector<Option<Options>> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// A command line as it is read: the position in it, and the options that came up.
struct OptionReader {
  const std::vector<std::string>& arguments;
  size_t index = 0;
  std::set<std::string> given;

  bool atEnd() const { return index >= arguments.size(); }

  /// The next argument's option, without dashes' short form, and its value after '=' if any.
  std::pair<std::string, std::optional<std::string>> nextName();

  /// A value at the current place, or nothing if an option or the end is there.
  std::optional<std::string> nextValue();

  void markGiven(const std::string& name, bool may_repeat);
};

/// Applies the next option with its value and moves on behind them.
template <class Options>
void parseOption(OptionReader& reader, const std::vector<Option<Options>>& all, Options& options) {
  const auto [name, attached] = reader.nextName();
  const Option<Options>* option = nullptr;
  for (const Option<Options>& candidate : all) {
    if (candidate.name == name) option = &candidate;
  }
  if (option == nullptr && name.rfind("-", 0) != 0) {
    throw UsageError("'" + name + "' belongs to no option");
  }
  if (option == nullptr) throw UsageError("unknown option " + name);
  const bool is_list = name == "--set";
  reader.markGiven(name, is_list);
  if (option->value.empty()) {
    if (attached) throw UsageError(name + " takes no value");
    option->apply(options, "");
    return;
  }
  const std::optional<std::string> value = attached ? attached : reader.nextValue();
  if (!value || value->empty()) throw UsageError(name + " needs a value (" + option->value + ")");
  option->apply(options, *value);
  if (!is_list) return;
  while (const std::optional<std::string> more = reader.nextValue()) option->apply(options, *more);
}

/// Reads a command line up to its end, or up to --help. @return the names that were given.
/// @throws UsageError that names the option.
template <class Options>
std::set<std::string> parseOptions(const std::vector<std::string>& arguments,
                                   const std::vector<Option<Options>>& all, Options& options) {
  OptionReader reader{arguments, 0, {}};
  while (!reader.atEnd() && !options.help) parseOption(reader, all, options);
  return reader.given;
}

template <class Options>
std::string describeOptions(const std::vector<Option<Options>>& all) {
  std::string text;
  for (const auto& option : all) {
    text += "  " + option.name + (option.value.empty() ? "" : " " + option.value) + "\n" +
            wrapHelp(option.help);
  }
  return text;
}

}  // namespace dtsdf
