#include "tiles/plan.h"

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

struct FieldWriter {
  Json& json;

  template <class Value>
  void operator()(const char* key, const Value& value) const {
    json[key] = value;
  }
};

struct FieldReader {
  const Json& json;

  template <class Value>
  void operator()(const char* key, Value& value) const {
    json.at(key).get_to(value);
  }
};

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
  visitReading(options, FieldWriter{json});
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
  visitReading(options, FieldReader{json});
  options.imu_topic = json.value("imu_topic", "");  // older plans have none
  if (json.count("units_per_metre")) recording.units_per_metre = json["units_per_metre"];
  if (json.count("intrinsics")) {
    const Json& K = json["intrinsics"];
    recording.intrinsics = Intrinsics{K.at(0), K.at(1), K.at(2), K.at(3)};
  }
  return options;
}

/// Calls visit(key, value) for what a recording has.
template <class Recording, class Visit>
void visitRecording(Recording& recording, const Visit& visit) {
  visit("path", recording.path);
  visit("format", recording.format);
  visit("fused", recording.fused);
  visit("supporting", recording.supporting);
  visit("images", recording.images);
}

/// The same of a tile.
template <class AnyTile, class Visit>
void visitTile(AnyTile& tile, const Visit& visit) {
  visit("first_block", tile.own.first);
  visit("last_block", tile.own.last);
  visit("first_fused", tile.fused.first);
  visit("last_fused", tile.fused.last);
  visit("frames", tile.frames);
  visit("images", tile.images);
  visit("most_blocks", tile.estimate.blocks);
  visit("most_voxel_arrays", tile.estimate.voxel_arrays);
  visit("most_own_blocks", tile.estimate.own_blocks);
  visit("most_map_bytes", tile.estimate.map_bytes);
  visit("most_free_bytes", tile.estimate.free_bytes);
  visit("seconds", tile.estimate.seconds);
}

/// The same of a plan, but for how it is read, settings and level.
template <class AnyPlan, class Visit>
void visitPlan(AnyPlan& plan, const Visit& visit) {
  visit("tile_m", plan.tile_m);
  visit("tile_blocks", plan.tile_blocks);
  visit("map_frame", plan.map_frame);
  visit("stamp_s", plan.stamp_s);
  visit("seconds", plan.seconds);
  visit("processor_s", plan.processor_s);
  visit("recordings", plan.recordings);
  visit("tiles", plan.tiles);
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

}  // namespace

// What nlohmann::json calls for the parts of a plan.

static void to_json(Json& json, const IndexRanges& ranges) { json = ranges.ranges(); }
static void from_json(const Json& json, IndexRanges& ranges) {
  ranges = IndexRanges(json.get<std::vector<IndexRanges::Range>>());
}

static void to_json(Json& json, const BlockKey& key) { json = {key.x, key.y, key.z}; }
static void from_json(const Json& json, BlockKey& key) {
  key = {json.at(0), json.at(1), json.at(2)};
}

static void to_json(Json& json, const PlannedImage& image) {
  json = {image.index, image.frames_before};
}
static void from_json(const Json& json, PlannedImage& image) { image = {json.at(0), json.at(1)}; }

static void to_json(Json& json, const PlannedRecording& recording) {
  visitRecording(recording, FieldWriter{json});
}
static void from_json(const Json& json, PlannedRecording& recording) {
  visitRecording(recording, FieldReader{json});
  checkOrder(recording);
}

static void to_json(Json& json, const Tile& tile) { visitTile(tile, FieldWriter{json}); }
static void from_json(const Json& json, Tile& tile) { visitTile(tile, FieldReader{json}); }

static void to_json(Json& json, const Plan& plan) {
  json = {{"format", kFormat}, {"reading", toJson(plan.reading)}, {"settings", Json::object()}};
  visitPlan(plan, FieldWriter{json});
  if (plan.T_W_M) json["level"] = toJson(*plan.T_W_M);
  for (const auto& [key, value] : plan.settings) json["settings"][key] = toJson(value);
}
static void from_json(const Json& json, Plan& plan) {
  if (json.at("format") != kFormat) throw std::runtime_error("it has another version");
  plan.reading = readingOf(json.at("reading"));
  visitPlan(plan, FieldReader{json});
  if (json.count("level")) plan.T_W_M = poseOf(json["level"]);
  for (const auto& [key, value] : json.at("settings").items()) plan.settings[key] = valueOf(value);
  if (plan.tiles.empty()) throw std::runtime_error("it has no tiles");
  for (const Tile& tile : plan.tiles) {
    if (tile.frames.size() != plan.recordings.size() ||
        tile.images.size() != plan.recordings.size()) {
      throw std::runtime_error("its tiles and recordings do not match");
    }
  }
}

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
    Json::parse(text).get_to(loaded.plan);
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + path + "' is not a plan (" + error.what() +
                             "); make it again with tiles plan");
  }
  loaded.id = hashText(text);
  return loaded;
}

void savePlan(const Plan& plan, const std::string& folder) {
  writeFileAtomically(planPath(folder),
                      Json(plan).dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

size_t readTileNumber(const std::string& text, const Plan& plan) {
  size_t number = 0;
  if (parseNumber(text, number) && number < plan.tiles.size()) return number;
  throw std::runtime_error("the plan has no tile '" + text + "'; its tiles are 0 to " +
                           std::to_string(plan.tiles.size() - 1));
}

}  // namespace dtsdf
