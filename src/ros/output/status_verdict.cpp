// judge(): what the status says first.

#include <algorithm>
#include <cmath>
#include <optional>

#include "ros/input/image_kind.h"
#include "ros/output/status_report.h"

namespace dtsdf {

using dtsdf_mapping::CameraStatus;
using dtsdf_mapping::DropCount;
using dtsdf_mapping::MapStatus;
using dtsdf_mapping::StreamStatus;

namespace {

/// Silence of so many times `status/stale_s` is an error.
constexpr double kErrorAfter = 3.0;

/// "; depth is published on '/a' and '/b'"; empty without topics.
std::string describeOthers(const char* what, const std::vector<std::string>& topics) {
  return topics.empty() ? "" : std::string("; ") + what + " is published on " + inQuotes(topics);
}

/// Why nobody publishes the depth images that are waited for.
std::string describeNoPublisher(const std::string& topic, const PublishedTopics& topics) {
  const auto isIn = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const std::string ending = kCompressedDepthTopic;
  const size_t end = topic.size() - std::min(topic.size(), ending.size());
  if (isIn(topics.only_compressed, topic)) {
    return "it is published as sensor_msgs/CompressedImage; set image_transport:=compressedDepth";
  }
  if (topic.compare(end, ending.size(), ending) == 0 && isIn(topics.depth, topic.substr(0, end))) {
    return "it is published as sensor_msgs/Image; set image_transport:=raw";
  }
  return "it has no publisher" + describeOthers("depth", topics.depth);
}

/// Begins what is said of one camera, where there are several.
std::string beginOf(const CameraReport& camera) {
  return camera.name.empty() ? "" : camera.name + ": ";
}

/// Nothing comes in that could be fused; empty text if something does.
Verdict judgeInput(const StreamReport& depth, const PublishedTopics& topics) {
  if (depth.frames.images == 0) {
    const std::string why = depth.image_publishers == 0
                                ? describeNoPublisher(depth.image_topic, topics)
                                : "its publisher has sent nothing yet";
    return {MapStatus::WARN, "no depth image received on '" + depth.image_topic + "': " + why};
  }
  if (depth.frames.camera_infos == 0) {
    return {MapStatus::WARN, "depth images are received, but no camera_info on '" +
                                 depth.info_topic + "'" +
                                 describeOthers("camera_info", topics.camera_info) +
                                 (topics.camera_info.empty() ? "" : "; set camera_info:=")};
  }
  return {MapStatus::OK, ""};
}

/// Drops that are worth a word, though most frames are fused; empty text if there are none. Of
/// fewer images than that a single drop would be.
Verdict judgeDrops(const DropShare& recent, const std::string& last_drop) {
  constexpr uint64_t kLeastImages = 50;
  constexpr double kWorthAWord = 0.02;
  if (recent.received < kLeastImages) return {MapStatus::OK, ""};
  const double share = static_cast<double>(recent.dropped) / static_cast<double>(recent.received);
  if (share <= kWorthAWord) return {MapStatus::OK, ""};
  const std::string remedy = remedyFor(recent.most_common);
  return {MapStatus::WARN, std::to_string(std::lround(100.0 * share)) +
                               " % of the depth images were dropped lately, most as " +
                               toString(recent.most_common) + ": " +
                               (remedy.empty() ? last_drop : remedy)};
}

/// For how long nothing has come while it could have; 0 if nothing ever has.
double silence(const std::optional<double>& age_s, const StatusInput& in) {
  return age_s ? std::min(*age_s, in.ran_s) : 0.0;
}

std::string ago(const std::optional<double>& age_s) {
  return age_s ? std::to_string(std::lround(*age_s)) + " s ago" : "never";
}

/// An input that has fallen silent, or of which nothing is fused any more; empty text if neither.
Verdict judgeSilence(const StreamReport& depth, const StatusInput& in) {
  const FrameCounts& frames = depth.frames;
  const double no_image_s = silence(frames.image_age_s, in);
  const double silent_s = std::max(no_image_s, silence(frames.fused_age_s, in));
  if (in.stale_s <= 0.0 || silent_s < in.stale_s) return {MapStatus::OK, ""};
  const std::string publisher = depth.image_publishers == 0 ? " (its publisher is gone)" : "";
  const std::string what = no_image_s >= in.stale_s ? "no depth image is received on '" +
                                                          depth.image_topic + "'" + publisher
                                                    : "no frame is fused: " + frames.last_drop;
  return {silent_s < kErrorAfter * in.stale_s ? MapStatus::WARN : MapStatus::ERROR,
          what + "; last image " + ago(frames.image_age_s) + ", last transform " +
              ago(in.transforms.age_s) + ", last fused frame " + ago(frames.fused_age_s)};
}

/// Frames come in, but none has become part of the map.
Verdict judgeFirstFrame(const StreamReport& depth) {
  if (!depth.waiting_for.empty()) {
    return {MapStatus::WARN, "no frame fused yet: " + depth.waiting_for};
  }
  if (depth.frames.droppedSum() > 0) {
    return {MapStatus::WARN, "no frame fused yet: " + depth.frames.last_drop};
  }
  return {MapStatus::OK, "waiting for the first frame with its camera_info and transform"};
}

uint64_t droppedSum(const std::vector<DropCount>& dropped) {
  uint64_t sum = 0;
  for (const DropCount& drop : dropped) sum += drop.count;
  return sum;
}

/// The same stream in the last status; an empty one if it was not there.
StreamStatus streamBefore(const MapStatus& before, const std::string& camera) {
  for (const CameraStatus& status : before.cameras) {
    if (status.name == camera && !status.streams.empty()) return status.streams.front();
  }
  return {};
}

/// Colour that has to be there, or comes and cannot be used; empty text if all is well.
Verdict judgeColour(const StreamReport& colour, bool is_needed) {
  if (colour.frames.fused > 0) return {MapStatus::OK, ""};
  if (colour.frames.images == 0) {
    if (!is_needed) return {MapStatus::OK, ""};
    return {MapStatus::WARN, "no colour image received on '" + colour.image_topic +
                                 "', which colour/enabled: always requires"};
  }
  if (colour.frames.camera_infos == 0) {
    return {MapStatus::WARN,
            "colour images are received, but no camera_info on '" + colour.info_topic + "'"};
  }
  if (colour.frames.droppedSum() == 0) return {MapStatus::OK, ""};
  return {MapStatus::WARN, "no colour image painted yet: " + colour.frames.last_drop};
}

Verdict judgeCamera(const CameraReport& camera, const DropShare& recent, const StatusInput& in,
                    const MapStatus& before) {
  const StreamReport& depth = camera.depth;
  Verdict silence = judgeSilence(depth, in);
  if (!silence.second.empty()) return silence;
  if (depth.frames.fused == 0) {
    const Verdict input = judgeInput(depth, in.topics);
    return input.second.empty() ? judgeFirstFrame(depth) : input;
  }
  const StreamStatus last = streamBefore(before, camera.name);
  if (depth.frames.droppedSum() - droppedSum(last.dropped) > depth.frames.fused - last.fused) {
    const std::string remedy = recent.dropped > 0 ? remedyFor(recent.most_common) : "";
    return {MapStatus::WARN, "most frames are dropped: " + depth.frames.last_drop +
                                 (remedy.empty() ? "" : "; " + remedy)};
  }
  if (!depth.warning.empty()) return {MapStatus::WARN, depth.warning};
  Verdict drops = judgeDrops(recent, depth.frames.last_drop);
  if (!drops.second.empty()) return drops;
  return camera.colour ? judgeColour(*camera.colour, camera.is_colour_needed)
                       : Verdict{MapStatus::OK, ""};
}

/// A camera that is tracked, and lost; empty text if it is not, or no images come.
Verdict judgePose(const CameraReport& camera, const CameraPoseReport* pose, const StatusInput& in) {
  const double no_image_s = silence(camera.depth.frames.image_age_s, in);
  const bool is_silent = in.stale_s > 0.0 && no_image_s >= in.stale_s;
  if (pose == nullptr || !pose->lost_since_s || is_silent) return {MapStatus::OK, ""};
  return {MapStatus::WARN,
          "the camera is lost, and nothing is fused: move it back slowly to where it was, or call "
          "set_pose, or clear_map to begin again"};
}

/// Of the cameras the first one with something amiss; else what the first has to say.
Verdict judgeCameras(const StatusInput& in, const MapStatus& before) {
  Verdict verdict{MapStatus::OK, ""};
  for (size_t i = 0; i < in.cameras.size(); ++i) {
    const CameraReport& camera = in.cameras[i];
    const DropShare recent = i < in.recent_drops.size() ? in.recent_drops[i] : DropShare();
    const CameraPoseReport* const pose =
        i < in.poses.cameras.size() ? &in.poses.cameras[i] : nullptr;
    Verdict own = judgePose(camera, pose, in);
    if (own.second.empty()) own = judgeCamera(camera, recent, in, before);
    if (!own.second.empty()) own.second = beginOf(camera) + own.second;
    if (own.first != MapStatus::OK) return own;
    if (verdict.second.empty()) verdict = own;
  }
  return verdict;
}

/// Points are the mesh's vertices, and space takes its surfaces from it.
bool isMeshWanted(const OutputReport& output) {
  return !output.space_topics.empty() ||
         std::any_of(output.topics.begin(), output.topics.end(),
                     [](const TopicStatus& topic) { return topic.listeners > 0; });
}

std::string describeMesh(const StatusInput& in) {
  if (in.time_stands)
    return "mapping; no new images: /clock is not advancing (the bag ended or is paused)";
  if (in.output.triangles > 0) return "mapping";
  if (!isMeshWanted(in.output)) return "mapping; no mesh yet, because nobody subscribes to it";
  return "mapping; no triangles yet: no surface has been seen by enough frames (mesh/min_support)";
}

bool hasFused(const StatusInput& in) {
  return std::any_of(in.cameras.begin(), in.cameras.end(),
                     [](const CameraReport& camera) { return camera.depth.frames.fused > 0; });
}

/// What the budget had no room for. Once something was refused this holds until the map is cleared,
/// so it must not stand before anything that is wrong now.
Verdict judgeBudget(const MapStats& stats) {
  if (stats.pages.lost > 0) {
    return {MapStatus::WARN,
            std::to_string(stats.pages.lost) +
                " blocks or sectors of cells could not be read back and are lost: " +
                stats.pages.problem};
  }
  if (stats.pages.failures > 0 && stats.refused_blocks > 0) {
    return {MapStatus::WARN, std::to_string(stats.refused_blocks) +
                                 " blocks were refused because of the disk of map/page_folder: " +
                                 stats.pages.problem};
  }
  if (stats.refused_blocks > 0) {
    return {MapStatus::WARN,
            "the map is full: " + std::to_string(stats.refused_blocks) +
                " blocks were refused; the map stays usable; raise map/max_memory_mb or set "
                "map/keep_radius_m or map/page_folder"};
  }
  if (stats.refused_cubes > 0 && stats.pages.failures > 0) {
    return {MapStatus::WARN,
            std::to_string(stats.refused_cubes) +
                " times a cube of cells stayed unknown because of the disk of map/page_folder: " +
                stats.pages.problem};
  }
  if (stats.refused_cubes > 0) {
    return {MapStatus::WARN,
            "the memory for free space (an eighth of map/max_memory_mb) is full: " +
                std::to_string(stats.refused_cubes) +
                " times a cube of cells stayed unknown; surfaces are still mapped; raise "
                "map/max_memory_mb or space/cell_voxels"};
  }
  return {MapStatus::OK, ""};
}

}  // namespace

Verdict judge(const StatusInput& in, const MapStatus& before) {
  if (!in.map.failure.empty()) {
    return {MapStatus::ERROR, "the backend failed: " + in.map.failure};
  }
  if (!in.master.empty()) return {MapStatus::ERROR, in.master};
  if (in.paused) return {MapStatus::OK, "paused"};
  Verdict cameras = judgeCameras(in, before);
  if (in.transforms.refused > before.transforms_refused) {
    const std::string also = cameras.first == MapStatus::OK ? "" : cameras.second + "; ";
    cameras = {std::max<uint8_t>(cameras.first, MapStatus::WARN),
               also + "transforms are refused: " + in.transforms.last_refusal};
  }
  if (cameras.first != MapStatus::OK) return cameras;
  Verdict budget = judgeBudget(in.map.stats);
  if (budget.first != MapStatus::OK) return budget;
  const PagedMeshes::Stats& meshes = in.output.paged_meshes;
  if (meshes.lost > 0) {
    return {MapStatus::WARN,
            "the meshes of " + std::to_string(meshes.lost) +
                " blocks could not be read back and are not shown: " + meshes.problem};
  }
  if (const PagedValues::Stats& cells = in.output.paged_space; cells.lost > 0) {
    return {MapStatus::WARN, std::to_string(cells.lost) +
                                 " sectors of cells and distances for planners could not be read "
                                 "back: " +
                                 cells.problem};
  }
  if (meshes.failures > 0 && in.output.mesh_bytes > in.output.max_mesh_bytes) {
    return {MapStatus::WARN, "meshes stay in memory: " + meshes.problem};
  }
  if (!in.log.problem.empty()) {
    return {MapStatus::WARN, "frame log: " + in.log.problem};
  }
  if (!in.poses.problem.empty()) return {MapStatus::WARN, in.poses.problem};
  if (!hasFused(in)) return cameras;
  const std::string& obstacle = in.correction.obstacle;
  return {MapStatus::OK,
          describeMesh(in) + (obstacle.empty() ? "" : "; poses cannot be corrected: " + obstacle)};
}

}  // namespace dtsdf
