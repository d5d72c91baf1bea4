#include "io/pose_files.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "io/camera_file.h"
#include "io/text_file.h"
#include "params/text.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;
using Pose = std::optional<Eigen::Isometry3d>;

const char* const kPosesAdvice = "expected a file with poses";

using NamedPoses = std::map<std::string, Pose>;

/// The keys under which an image's pose is stored: the image's name, with and without the folder,
/// and the number at the end of the name.
std::vector<std::string> keysOf(const std::string& path) {
  const fs::path name = fs::path(path).replace_extension();
  const std::string last = name.filename().string();
  std::vector<std::string> keys{name.parent_path().filename().string() + "/" + last, last};
  if (const auto number = numberAtEnd(path)) keys.push_back("#" + shortestText(*number, 17));
  return keys;
}

void add(const std::string& path, const Pose& pose, NamedPoses& named) {
  for (const std::string& key : keysOf(path)) named.emplace(key, pose);
}

/// Reads the poses in COLMAP's images.txt. Each line consists of the image ID, qw qx qy qz and tx
/// ty tz from world to camera, the camera ID, and the file name.
NamedPoses posesOfColmap(const std::vector<ListLine>& lines) {
  NamedPoses named;
  for (const ListLine& line : lines) {
    if (line.words.size() != 10) continue;  // a line of image points (x, y, ID)
    double v[8];
    for (size_t i = 1; i < 8; ++i) v[i] = numberAt(line, i);
    const Pose T_C_W = poseOf({v[5], v[6], v[7]}, {v[1], v[2], v[3], v[4]});
    if (!T_C_W) throwAt(line, "the quaternion's length is not 1");
    add(line.words[9], T_C_W, named);
  }
  return named;
}

/// Reads the poses in the transforms.json of nerfstudio, instant-ngp or `map_tool export`.
NamedPoses posesOfTransforms(const std::string& path) {
  NamedPoses named;
  const nlohmann::json root = readJsonFile(path, kPosesAdvice);
  for (const char* const list : {"depth_frames", "frames"}) {
    for (const nlohmann::json& frame : root.value(list, nlohmann::json::array())) {
      std::vector<std::string> words;
      for (const auto& number : frame.at("transform_matrix").flatten())
        words.push_back(number.dump());
      const Pose pose = rigidMotion(parseMatrix(words, 4, 4, path));
      for (const char* const name : {"depth_file_path", "file_path"}) {
        if (frame.contains(name)) add(frame[name].get<std::string>(), pose, named);
      }
    }
  }
  return named;
}

/// Parses a list of matrices: 12 or 16 numbers per line, or four lines of four numbers each. In
/// Open3D's trajectory.log, a line of three numbers precedes each matrix.
std::vector<Pose> posesInOrder(const std::vector<ListLine>& lines) {
  const size_t first = lines.front().words.size();
  const size_t in_line = first == 3 ? 4 : first;
  std::vector<Pose> poses;
  std::vector<std::string> words;
  for (const ListLine& line : lines) {
    if (first == 3 && line.words.size() == 3 && words.empty()) continue;
    if (line.words.size() != in_line) {
      throwAt(line, "expected " + std::to_string(in_line) + " numbers");
    }
    words.insert(words.end(), line.words.begin(), line.words.end());
    if (in_line == 12) words.insert(words.end(), {"0", "0", "0", "1"});
    if (words.size() < 16) continue;
    poses.push_back(rigidMotion(parseMatrix(words, 4, 4, line.place)));
    words.clear();
  }
  if (!words.empty() || poses.empty()) throwAt(lines.back(), "expected 4 x 4 numbers");
  return poses;
}

void findInOrder(const std::vector<Pose>& poses, const std::vector<StampedImage>& depth,
                 std::vector<StampedImage>& images) {
  const auto placeInDepth = [&](double stamp_s) {
    const auto found =
        std::lower_bound(depth.begin(), depth.end(), stamp_s,
                         [](const StampedImage& a, double stamp) { return a.stamp_s < stamp; });
    const bool is_listed = found != depth.end() && found->stamp_s == stamp_s;
    return is_listed ? static_cast<double>(found - depth.begin()) : -1.0;
  };
  for (size_t i = 0; i < images.size(); ++i) {
    double number = images[i].stamp_s;
    if (poses.size() == images.size()) {
      number = static_cast<double>(i);
    } else if (poses.size() == depth.size()) {
      number = placeInDepth(number);
    }
    const bool has_pose = number >= 0.0 && number < static_cast<double>(poses.size());
    if (has_pose) images[i].T_W_C = poses[static_cast<size_t>(number)];
    images[i].missing = has_pose ? "the pose is not a rigid motion, or tracking was lost"
                                 : "no pose with the same number";
  }
}

void findAsGiven(const std::string& path, double tolerance_s,
                 const std::vector<StampedImage>& depth, std::vector<StampedImage>& images,
                 std::string& convention) {
  NamedPoses named;
  const char* default_convention = "optical";
  if (fs::is_directory(path)) {
    for (const auto& file : fs::directory_iterator(path)) {
      if (file.path().extension() != ".txt") continue;
      const std::string name = file.path().string();
      add(name, rigidMotion(readMatrixFile(name, 4, 4, kPosesAdvice)), named);
    }
  } else if (endsWith(path, ".json")) {
    named = posesOfTransforms(path);
    default_convention = "opengl";
  } else {
    const std::vector<ListLine> lines = readList(path, kPosesAdvice);
    const size_t words = lines.empty() ? 8 : lines.front().words.size();
    if (words != 10 && words != 3 && words != 4 && words != 12 && words != 16) {
      return findPosesNear(readTrajectory(path, kPosesAdvice), tolerance_s, images);
    }
    if (words != 10) return findInOrder(posesInOrder(lines), depth, images);
    named = posesOfColmap(lines);
    default_convention = "inverted";
  }
  if (convention.empty()) convention = default_convention;
  for (StampedImage& image : images) {
    image.missing = "no pose with the same name or number";
    for (const std::string& key : keysOf(image.path)) {
      const auto found = named.find(key);
      if (found == named.end()) continue;
      image.T_W_C = found->second;
      image.missing = "the pose is not a rigid motion, or tracking was lost";
      break;
    }
  }
}

}  // namespace

void convertToOptical(const std::string& convention, std::vector<StampedImage>& images) {
  for (StampedImage& image : images) {
    if (image.T_W_C) image.T_W_C = opticalPose(*image.T_W_C, convention);
  }
}

void findPosesIn(const std::string& path, double tolerance_s,
                 const std::vector<StampedImage>& depth, std::vector<StampedImage>& images,
                 std::string convention) try {
  findAsGiven(path, tolerance_s, depth, images, convention);
  convertToOptical(convention, images);
} catch (const nlohmann::json::exception& error) {
  throw std::runtime_error(path + ": " + error.what());
}

Eigen::Isometry3d opticalPose(const Eigen::Isometry3d& pose, const std::string& convention) {
  if (convention.empty() || convention == "optical") return pose;
  if (convention == "inverted") return pose.inverse();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (convention == "opengl") {
    T.linear().diagonal() << 1, -1, -1;
  } else if (convention == "body") {
    T.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  } else {
    throw std::invalid_argument("the pose convention must be optical, opengl, body or inverted");
  }
  return pose * T;
}

std::optional<double> numberAtEnd(const std::string& path) {
  const std::string name = fs::path(path).stem().string();
  size_t begin = name.size();
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(name[begin - 1])) != 0) --begin;
  double number = 0.0;
  if (parseNumber(name, number)) return number;  // the whole name, such as a stamp
  return parseNumber(name.substr(begin), number) ? std::optional<double>(number) : std::nullopt;
}

nlohmann::json readJsonFile(const std::string& path, const std::string& advice) {
  nlohmann::json root = nlohmann::json::parse(readTextFile(path, advice), nullptr, false);
  if (root.is_object()) return root;
  throw std::runtime_error(path + ": not a JSON object; " + advice);
}

}  // namespace dtsdf
