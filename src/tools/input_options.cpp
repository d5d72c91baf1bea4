#include "tools/input_options.h"

#include <algorithm>
#include <utility>

namespace dtsdf {
namespace {

/// The formats' names, "bag" and "log" included.
std::vector<std::string> formatNames() {
  std::vector<std::string> names = recordingFormats();
  names.push_back("bag");
  names.push_back("log");
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
    throw UsageError("'" + text + "' is not one of " + joined(names));
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

}  // namespace

void addFormatOption(CommandLine& line, InputOptions& options) {
  line.add({"--format", joined(formatNames()), "format of the recording (default: detected)"},
           [&](const std::string& value) { options.recording.format = parseFormat(value); });
}

void addReadingOptions(CommandLine& line, InputOptions& options) {
  RecordingOptions& recording = options.recording;
  line.add({"--intrinsics", "FX,FY,CX,CY",
            "camera in pixels, instead of the recording's; a negative FY flips the rows of a "
            "folder's images, for cameras whose y axis points up"},
           [&](const std::string& value) { recording.intrinsics = parseIntrinsics(value); });
  line.addText({"--poses", "FILE",
                "poses to use instead of the recording's: `stamp tx ty tz qx qy qz qw` per line, "
                "camera to world, in metres; images without stamps use their number"},
               recording.poses_path);
  addFolderOptions(line, options);
  line.addText({"--depth-topic", "T", "a bag's depth images (default: the only such topic)"},
               options.depth_topic);
  line.addText({"--info-topic", "T", "their camera_info (default: beside the depth topic)"},
               options.info_topic);
  line.addText({"--mask-topic", "T",
                "a bag's masks: mono8, not 0 where the image shows what is not part of the scene "
                "(default: none)"},
               options.mask_topic);
  line.addText({"--color-topic", "T",
                "a bag's colour images, with camera_info beside them (default: the only such "
                "topic)"},
               options.colour_topic);
  line.addText({"--imu-topic", "T",
                "a bag's sensor_msgs/Imu for map/level: imu (default: the only such topic)"},
               options.imu_topic);
}

void checkReadingOptions(const InputOptions& options) {
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
  const std::pair<const char*, const std::string&> topics[] = {
      {"--depth-topic", options.depth_topic},
      {"--info-topic", options.info_topic},
      {"--mask-topic", options.mask_topic},
      {"--color-topic", options.colour_topic},
      {"--imu-topic", options.imu_topic}};
  for (const auto& [option, topic] : topics) {
    if (!is_bag && !topic.empty()) {
      throw UsageError(std::string(option) + " is for bags, and " + read_as);
    }
  }
}

}  // namespace dtsdf
