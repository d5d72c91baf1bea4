#include "io/tum_sequence.h"

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "io/text_file.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

/// A line's words, and where it stands.
struct ListLine {
  std::vector<std::string> words;
  std::string place;  ///< "file:line"
};

[[noreturn]] void throwAt(const ListLine& line, const std::string& problem) {
  throw std::runtime_error(line.place + ": " + problem);
}

std::vector<std::string> splitWords(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::vector<ListLine> readList(const fs::path& path) {
  std::istringstream text(readTextFile(path.string(),
                                       "a TUM folder has depth.txt, groundtruth.txt and "
                                       "camera_info.yaml"));
  std::vector<ListLine> lines;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    std::vector<std::string> words = splitWords(line);  // takes a carriage return as a space
    if (words.empty() || words[0][0] == '#') continue;
    lines.push_back({std::move(words), path.string() + ":" + std::to_string(number)});
  }
  return lines;
}

double readNumber(const ListLine& line, size_t index) {
  double number = 0.0;
  if (!parseNumber(line.words[index], number) || !std::isfinite(number)) {
    throwAt(line, "'" + line.words[index] + "' is not a number");
  }
  return number;
}

std::vector<StampedImage> readImageList(const fs::path& path) {
  std::vector<StampedImage> images;
  for (const ListLine& line : readList(path)) {
    if (line.words.size() != 2) throwAt(line, "expected 'stamp file'");
    images.push_back({readNumber(line, 0), (path.parent_path() / line.words[1]).string()});
  }
  return images;
}

StampedPose readPose(const ListLine& line) {
  if (line.words.size() != 8) throwAt(line, "expected 'stamp tx ty tz qx qy qz qw'");
  double v[8];
  for (size_t i = 0; i < 8; ++i) v[i] = readNumber(line, i);
  Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
  // Rounding to a few decimals leaves a small error; anything larger is not a rotation.
  if (std::abs(q.norm() - 1.0) > 0.01) throwAt(line, "the quaternion's length is not 1");
  StampedPose pose{v[0], Eigen::Isometry3d::Identity()};
  pose.T_W_C.linear() = q.normalized().toRotationMatrix();
  pose.T_W_C.translation() = Eigen::Vector3d(v[1], v[2], v[3]);
  return pose;
}

Trajectory readTrajectory(const fs::path& path) {
  std::vector<StampedPose> poses;
  for (const ListLine& line : readList(path)) poses.push_back(readPose(line));
  return Trajectory(std::move(poses));
}

}  // namespace

TumSequence readTumSequence(const std::string& folder) {
  if (!fs::is_directory(folder)) {
    throw std::runtime_error("'" + folder + "' is not a folder; give the folder of a TUM sequence");
  }
  const fs::path root(folder);
  TumSequence sequence;
  sequence.depth = readImageList(root / "depth.txt");
  if (sequence.depth.empty()) {
    throw std::runtime_error((root / "depth.txt").string() + ": lists no depth image");
  }
  sequence.trajectory = readTrajectory(root / "groundtruth.txt");
  sequence.camera = loadCameraInfo((root / "camera_info.yaml").string());
  if (fs::exists(root / "rgb.txt")) sequence.colour = readImageList(root / "rgb.txt");
  return sequence;
}

}  // namespace dtsdf
