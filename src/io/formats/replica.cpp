// Replica as rendered by NICE-SLAM (github.com/cvg/nice-slam): results/depthNUMBER.png and, from
// the same camera, results/frameNUMBER.jpg; traj.txt with a line of 16 numbers per image, camera to
// world (x right, y down, z forward); and, in the parent folder, cam_params.json with the image
// size, the intrinsics and the depth units per metre, which apply to all rooms.
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/camera_file.h"
#include "io/formats/folder_format.h"
#include "io/formats/numbered_files.h"
#include "io/pose_files.h"

namespace dtsdf {
namespace replica {

namespace fs = std::filesystem;

/// The value used in NICE-SLAM's own recordings.
constexpr double kUnitsPerMetre = 6553.5;

std::vector<StampedImage> listDepth(const fs::path& folder) {
  return listNumberedFiles(folder / "results", "depth", ".png");
}

std::string posesPath(const fs::path& folder) { return (folder / "traj.txt").string(); }

fs::path paramsPath(const fs::path& folder) { return folder / ".." / "cam_params.json"; }

/// Reads the camera object in cam_params.json. @throws std::runtime_error
nlohmann::json readParams(const fs::path& path) {
  const nlohmann::json root =
      readJsonFile(path.string(), "expected Replica's camera; or give --intrinsics fx,fy,cx,cy");
  if (!root.contains("camera") || !root["camera"].is_object()) {
    throw std::runtime_error(path.string() +
                             ": expected {\"camera\": {\"w\", \"h\", \"fx\", "
                             "\"fy\", \"cx\", \"cy\", \"scale\"}}");
  }
  return root["camera"];
}

double paramOf(const nlohmann::json& camera, const char* key, const fs::path& path) {
  const auto found = camera.find(key);
  if (found == camera.end() || !found->is_number() || !(found->get<double>() > 0.0) ||
      !(found->get<double>() < 1e6)) {
    throw std::runtime_error(path.string() + ": camera/" + key +
                             " must be a number above 0 and below 1e6");
  }
  return found->get<double>();
}

std::optional<CameraInfo> readCamera(const fs::path& folder, const std::vector<StampedImage>&) {
  const fs::path path = paramsPath(folder);
  const nlohmann::json camera = readParams(path);
  const auto number = [&](const char* key) { return paramOf(camera, key, path); };
  const auto pixels = [&](const char* key) { return static_cast<float>(number(key)); };
  return CameraInfo{static_cast<int>(std::lround(number("w"))),
                    static_cast<int>(std::lround(number("h"))),
                    {pixels("fx"), pixels("fy"), pixels("cx"), pixels("cy")}};
}

std::optional<double> unitsOf(const fs::path& folder) {
  const fs::path path = paramsPath(folder);
  if (!fs::exists(path)) return std::nullopt;
  return paramOf(readParams(path), "scale", path);
}

RecordedImages findColours(const fs::path& folder, const CameraInfo& depth_camera) {
  return {listNumberedFiles(folder / "results", "frame", ".jpg"), depth_camera};
}

}  // namespace replica

FolderFormat replicaFormat() {
  using namespace replica;
  return {"replica",   "results/depthNUMBER.png",
          nullptr,     listDepth,
          nullptr,     readCamera,
          findColours, kUnitsPerMetre,
          unitsOf,     std::nullopt,
          posesPath};
}

}  // namespace dtsdf
