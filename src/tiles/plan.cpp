#include "tiles/plan.h"

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/atomic_file.h"
#include "io/file_hash.h"
#include "io/text_file.h"
#include "tiles/tile_folder.h"

namespace dtsdf {
namespace {

using Json = nlohmann::json;

constexpr int kFormat = 2;

Json toJson(const IndexRanges& ranges) {
  Json list = Json::array();
  for (const auto& [first, last] : ranges.ranges()) list.push_back({first, last});
  return list;
}

IndexRanges rangesOf(const Json& list) {
  std::vector<IndexRanges::Range> ranges;
  for (const Json& range : list) ranges.push_back({range.at(0), range.at(1)});
  return IndexRanges(std::move(ranges));
}

Json toJson(const BlockKey& key) { return {key.x, key.y, key.z}; }

BlockKey keyOf(const Json& list) { return {list.at(0), list.at(1), list.at(2)}; }

Json toJson(const ParamValue& value) {
  return std::visit([](const auto& held) { return Json(held); }, value);
}

ParamValue valueOf(const Json& json) {
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_number_integer()) return json.get<int>();
  if (json.is_number()) return json.get<double>();
  if (json.is_array()) return json.get<std::vector<std::string>>();
  return json.get<std::string>();
}

/// Calls visit(key, value) for what every plan has of how recordings are read.
template <class Options, class Visit>
void visitReading(Options& options, const Visit& visit) {
  visit("poses", options.recording.poses_path);
  visit("pose_tolerance_s", options.recording.pose_tolerance_s);
  visit("first", options.recording.selection.first);
  visit("last", options.recording.selection.last);
  visit("step", options.recording.selection.step);
  visit("depth_topic", options.depth_topic);
  visit("info_topic", options.info_topic);
  visit("mask_topic", options.mask_topic);
  visit("colour_topic", options.colour_topic);
}

Json toJson(const InputOptions& options) {
  const RecordingOptions& recording = options.recording;
  Json json = {{"imu_topic", options.imu_topic}};
  visitReading(options, [&](const char* key, const auto& value) { json[key] = value; });
  if (recording.units_per_metre) json["units_per_metre"] = *recording.units_per_metre;
  if (recording.intrinsics) {
    const Intrinsics& K = *recording.intrinsics;
    json["intrinsics"] = {K.fx, K.fy, K.cx, K.cy};
  }
  return json;
}

InputOptions readingOf(const Json& json) {
  InputOptions options;
  RecordingOptions& recording = options.recording;
  visitReading(options, [&](const char* key, auto& value) { json.at(key).get_to(value); });
  options.imu_topic = json.value("imu_topic", "");  // older plans have none
  if (json.count("units_per_metre")) recording.units_per_metre = json["units_per_metre"];
  if (json.count("intrinsics")) {
    const Json& K = json["intrinsics"];
    recording.intrinsics = Intrinsics{K.at(0), K.at(1), K.at(2), K.at(3)};
  }
  return options;
}

Json toJson(const std::vector<IndexRanges>& by_recording) {
  Json list = Json::array();
  for (const IndexRanges& of_recording : by_recording) list.push_back(toJson(of_recording));
  return list;
}

std::vector<IndexRanges> rangesByRecording(const Json& list) {
  std::vector<IndexRanges> ranges;
  for (const Json& of_recording : list) ranges.push_back(rangesOf(of_recording));
  return ranges;
}

Json toJson(const PlannedRecording& recording) {
  Json images = Json::array();
  for (const PlannedImage& image : recording.images) {
    images.push_back({image.index, image.frames_before});
  }
  return {{"path", recording.path},
          {"format", recording.format},
          {"fused", toJson(recording.fused)},
          {"supporting", toJson(recording.supporting)},
          {"images", images}};
}

PlannedRecording recordingOf(const Json& json) {
  PlannedRecording recording{json.at("path"),
                             json.at("format"),
                             rangesOf(json.at("fused")),
                             rangesOf(json.at("supporting")),
                             {}};
  for (const Json& image : json.at("images")) {
    recording.images.push_back({image.at(0), image.at(1)});
  }
  return recording;
}

/// @throws std::runtime_error for images that nobody would come to paint.
void checkOrder(const PlannedRecording& recording) {
  const size_t frames = recording.fused.count();
  PlannedImage before{0, 0};
  for (const PlannedImage& image : recording.images) {
    const bool is_first = &image == &recording.images.front();
    if (image.frames_before < before.frames_before || image.frames_before > frames ||
        (!is_first && image.index <= before.index)) {
      throw std::runtime_error("its colour images are not in order");
    }
    before = image;
  }
}

Json toJson(const Tile& tile) {
  return {{"first_block", toJson(tile.own.first)},
          {"last_block", toJson(tile.own.last)},
          {"first_fused", toJson(tile.fused.first)},
          {"last_fused", toJson(tile.fused.last)},
          {"frames", toJson(tile.frames)},
          {"images", toJson(tile.images)},
          {"most_blocks", tile.estimate.blocks},
          {"most_voxel_arrays", tile.estimate.voxel_arrays},
          {"most_own_blocks", tile.estimate.own_blocks},
          {"most_map_bytes", tile.estimate.map_bytes},
          {"most_free_bytes", tile.estimate.free_bytes},
          {"seconds", tile.estimate.seconds}};
}

Tile tileOf(const Json& json) {
  Tile tile;
  tile.own = {keyOf(json.at("first_block")), keyOf(json.at("last_block"))};
  tile.fused = {keyOf(json.at("first_fused")), keyOf(json.at("last_fused"))};
  tile.frames = rangesByRecording(json.at("frames"));
  tile.images = rangesByRecording(json.at("images"));
  tile.estimate = {json.at("most_blocks"),     json.at("most_voxel_arrays"),
                   json.at("most_own_blocks"), json.at("most_map_bytes"),
                   json.at("most_free_bytes"), json.at("seconds")};
  return tile;
}

/// Its rows, one after the other.
Json toJson(const Eigen::Isometry3d& T) {
  Json numbers = Json::array();
  for (int i = 0; i < 12; ++i) numbers.push_back(T.matrix()(i / 4, i % 4));
  return numbers;
}

Eigen::Isometry3d poseOf(const Json& numbers) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 12; ++i) T.matrix()(i / 4, i % 4) = numbers.at(static_cast<size_t>(i));
  return T;
}

Json toJson(const Plan& plan) {
  Json json = {{"format", kFormat},           {"reading", toJson(plan.reading)},
               {"tile_m", plan.tile_m},       {"tile_blocks", plan.tile_blocks},
               {"map_frame", plan.map_frame}, {"stamp_s", plan.stamp_s},
               {"seconds", plan.seconds},     {"processor_s", plan.processor_s},
               {"settings", Json::object()},  {"recordings", Json::array()},
               {"tiles", Json::array()}};
  if (plan.T_W_M) json["level"] = toJson(*plan.T_W_M);
  for (const auto& [key, value] : plan.settings) json["settings"][key] = toJson(value);
  for (const PlannedRecording& recording : plan.recordings) {
    json["recordings"].push_back(toJson(recording));
  }
  for (const Tile& tile : plan.tiles) json["tiles"].push_back(toJson(tile));
  return json;
}

Plan planOf(const Json& json) {
  if (json.at("format") != kFormat) throw std::runtime_error("it has another version");
  Plan plan;
  plan.reading = readingOf(json.at("reading"));
  json.at("tile_m").get_to(plan.tile_m);
  json.at("tile_blocks").get_to(plan.tile_blocks);
  json.at("map_frame").get_to(plan.map_frame);
  if (json.count("level")) plan.T_W_M = poseOf(json["level"]);
  json.at("stamp_s").get_to(plan.stamp_s);
  json.at("seconds").get_to(plan.seconds);
  json.at("processor_s").get_to(plan.processor_s);
  for (const auto& [key, value] : json.at("settings").items()) plan.settings[key] = valueOf(value);
  for (const Json& recording : json.at("recordings")) {
    plan.recordings.push_back(recordingOf(recording));
    checkOrder(plan.recordings.back());
  }
  for (const Json& tile : json.at("tiles")) plan.tiles.push_back(tileOf(tile));
  if (plan.tiles.empty()) throw std::runtime_error("it has no tiles");
  for (const Tile& tile : plan.tiles) {
    if (tile.frames.size() != plan.recordings.size() ||
        tile.images.size() != plan.recordings.size()) {
      throw std::runtime_error("its tiles and recordings do not match");
    }
  }
  return plan;
}

}  // namespace

InputOptions Plan::inputOf(size_t recording) const {
  InputOptions input = reading;
  input.recording.path = recordings[recording].path;
  input.recording.format = recordings[recording].format;
  return input;
}

LoadedPlan loadPlan(const std::string& folder) {
  const std::string path = planPath(folder);
  const std::string text = readTextFile(path, "make it with tiles plan");
  LoadedPlan loaded;
  try {
    loaded.plan = planOf(Json::parse(text));
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + path + "' is not a plan (" + error.what() +
                             "); make it again with tiles plan");
  }
  loaded.id = hashText(text);
  return loaded;
}

void savePlan(const Plan& plan, const std::string& folder) {
  writeFileAtomically(planPath(folder),
                      toJson(plan).dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

size_t readTileNumber(const std::string& text, const Plan& plan) {
  size_t number = 0;
  if (parseNumber(text, number) && number < plan.tiles.size()) return number;
  throw std::runtime_error("the plan has no tile '" + text + "'; its tiles are 0 to " +
                           std::to_string(plan.tiles.size() - 1));
}

}  // namespace dtsdf
