// map_tool export: the images of a journal, as trainers of radiance fields and splats read them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <unordered_set>

#include "backend/frame_check.h"
#include "io/atomic_file.h"
#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "io/little_endian.h"
#include "journal/replay.h"
#include "params/text.h"
#include "program/run_program.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

using Json = nlohmann::json;

struct ExportOptions {
  std::string journal_path, out_path, poses_path;
  double point_m = 0.02;
};

ExportOptions parseExportOptions(const std::vector<std::string>& arguments) {
  ExportOptions options;
  CommandLine line(
      "map_tool export", "JOURNAL --transforms OUT [options]",
      "Writes the images of a journal into a folder: images/ (PNG), depth/ (16-bit PNG, "
      "millimetres), points.ply and transforms.json, with cameras and poses as NeRF and "
      "splat trainers read them (OpenGL axes, the journal's map frame).");
  line.addText({"JOURNAL", "", "a journal that the node wrote"}, options.journal_path);
  line.addText({"--transforms", "OUT", "the folder"}, options.out_path);
  line.require("--transforms");
  line.addText({"--poses", "FILE", "corrected poses, as reconstruct takes them"},
               options.poses_path);
  line.addNumber({"--point-m", "METRES", "a point per cube of this edge"}, options.point_m,
                 {1e-4, 10.0});
  line.parse(arguments);
  return options;
}

/// Camera axes right, up, back, in place of right, down, forward.
Json openGlPose(const Eigen::Isometry3d& T_W_C) {
  Eigen::Matrix4d T = T_W_C.matrix();
  T.block<4, 2>(0, 1) *= -1.0;
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) rows.push_back({T(row, 0), T(row, 1), T(row, 2), T(row, 3)});
  return rows;
}

template <class Frame>
void putCamera(const Frame& frame, Json& json) {
  const Intrinsics& K = frame.intrinsics;
  json["camera_model"] = "PINHOLE";
  json["w"] = frame.width;
  json["h"] = frame.height;
  json["fl_x"] = K.fx;
  json["fl_y"] = K.fy;
  json["cx"] = K.cx + 0.5f;  // from the corner of the first pixel
  json["cy"] = K.cy + 0.5f;
}

DepthImage millimetresOf(const DepthFrame& frame) {
  DepthImage image{{frame.width, frame.height}, {}};
  constexpr float kMost = std::numeric_limits<uint16_t>::max() - 1;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      const float mm = std::floor(1000.0f * frame.unit_m * rawDepth(frame, u, v) + 0.5f);
      image.pixels.push_back(static_cast<uint16_t>(mm > 0.0f && mm <= kMost ? mm : 0.0f));
    }
  }
  return image;
}

RgbImage rgbOf(const ColourFrame& frame) {
  const PixelLayout layout = layoutOf(frame.encoding);
  RgbImage image{frame.width, frame.height, {}};
  for (int v = 0; v < frame.height; ++v) {
    const auto* const row = static_cast<const uint8_t*>(frame.data) + v * frame.row_bytes;
    for (int u = 0; u < frame.width; ++u) {
      const uint8_t* const pixel = row + u * layout.bytes;
      for (const int byte : {layout.red, layout.green, layout.blue}) {
        image.rgb.push_back(pixel[byte]);
      }
    }
  }
  return image;
}

/// A point of a surface for each cube of space, with its colour in the newest image before.
class PointCloud {
 public:
  explicit PointCloud(double cube_m) : cube_m_(cube_m) {}

  void setImage(const ColourFrame& frame, RgbImage image) {
    camera_ = frame;
    T_C_W_ = frame.T_W_C.inverse();
    image_ = std::move(image);
  }

  void add(const DepthFrame& frame, const MapperParams& params) {
    const DepthRange range = depthRangeOf(frame, params);
    const Intrinsics& K = frame.intrinsics;
    constexpr int kStep = 2;
    for (int v = 0; v < frame.height; v += kStep) {
      for (int u = 0; u < frame.width; u += kStep) {
        const float inverse_depth = inverseDepth(rawDepth(frame, u, v), range);
        if (!(inverse_depth > 0.0f)) continue;
        const double z = 1.0 / static_cast<double>(inverse_depth);
        addPoint(frame.T_W_C * Eigen::Vector3d(z * (u - K.cx) / K.fx, z * (v - K.cy) / K.fy, z));
      }
    }
  }

  /// @return how many points there are.
  size_t save(const std::string& path) const {
    AtomicFile file(path);
    std::string header = "ply\nformat binary_little_endian 1.0\ncomment metres, map frame\n";
    header += "element vertex " + std::to_string(points_.size()) + "\n";
    for (const char* name : {"x", "y", "z"}) header += std::string("property float ") + name + "\n";
    for (const char* name : {"red", "green", "blue"}) {
      header += std::string("property uchar ") + name + "\n";
    }
    file.write(header + "end_header\n");
    for (const Point& point : points_) {
      for (const float x : point.p_W) put(file, x);
      for (const uint8_t x : point.rgb) put(file, x);
    }
    file.commit();
    return points_.size();
  }

 private:
  struct Point {
    std::array<float, 3> p_W;
    std::array<uint8_t, 3> rgb;
  };

  void addPoint(const Eigen::Vector3d& p_W) {
    const Eigen::Vector3d cube = (p_W / cube_m_).array().floor();
    if (!(cube.cwiseAbs().maxCoeff() < kMaxBlockCoordinate)) return;
    const Vec3i key{int32_t(cube.x()), int32_t(cube.y()), int32_t(cube.z())};
    if (!cubes_.insert(packKey(key)).second) return;
    points_.push_back({{float(p_W.x()), float(p_W.y()), float(p_W.z())}, colourAt(p_W)});
  }

  /// Grey where no image is, or it does not look there.
  std::array<uint8_t, 3> colourAt(const Eigen::Vector3d& p_W) const {
    constexpr std::array<uint8_t, 3> kUnknown{128, 128, 128};
    if (image_.rgb.empty()) return kUnknown;
    const Eigen::Vector3d p_C = T_C_W_ * p_W;
    const Intrinsics& K = camera_.intrinsics;
    const double u = std::round(K.fx * p_C.x() / p_C.z() + K.cx);
    const double v = std::round(K.fy * p_C.y() / p_C.z() + K.cy);
    if (!(p_C.z() > 0.0 && u >= 0.0 && v >= 0.0 && u < image_.width && v < image_.height)) {
      return kUnknown;
    }
    const size_t at = 3 * (static_cast<size_t>(v) * image_.width + static_cast<size_t>(u));
    return {image_.rgb[at], image_.rgb[at + 1], image_.rgb[at + 2]};
  }

  const double cube_m_;
  ColourFrame camera_;
  Eigen::Isometry3d T_C_W_ = Eigen::Isometry3d::Identity();
  RgbImage image_;
  std::unordered_set<PackedKey> cubes_;
  std::vector<Point> points_;
};

/// Writes a journal's images one by one, and the lists of them at last.
class Exporter {
 public:
  Exporter(const ExportOptions& options, JournalReplay& journal)
      : options_(options),
        journal_(journal),
        params_(readMapperParams(journal.begin().settings)),
        cloud_(options.point_m) {
    if (journal.level()) T_M_W_ = journal.level()->inverse();
  }

  void writeAll() {
    while (const std::optional<JournalCall> call = journal_.next()) {
      if (const auto* const depth = std::get_if<journal::StoredDepth>(&call->content)) {
        DepthFrame frame = depth->frame;
        frame.T_W_C = T_M_W_ * frame.T_W_C;
        write(frame, call->stamp_s);
      } else if (const auto* const colour = std::get_if<journal::StoredColour>(&call->content)) {
        ColourFrame frame = colour->frame;
        frame.T_W_C = T_M_W_ * frame.T_W_C;
        write(frame, call->stamp_s);
      }
    }
    finish();
  }

 private:
  template <class Frame>
  Json entryOf(const Frame& frame, double stamp_s) const {
    Json entry;
    putCamera(frame, entry);
    entry["transform_matrix"] = openGlPose(frame.T_W_C);
    entry["stamp"] = stamp_s;
    return entry;
  }

  void write(const DepthFrame& frame, double stamp_s) {
    cloud_.add(frame, params_);
    depth_path_ = "depth/" + formatted("%06zu.png", depths_.size());
    depth_stamp_s_ = stamp_s;
    writeFileAtomically(options_.out_path + "/" + depth_path_,
                        encodeDepthPng(millimetresOf(frame)));
    Json entry = entryOf(frame, stamp_s);
    entry["depth_file_path"] = depth_path_;
    depths_.push_back(std::move(entry));
  }

  void write(const ColourFrame& frame, double stamp_s) {
    RgbImage image = rgbOf(frame);
    const std::string path = "images/" + formatted("%06zu.png", frames_.size());
    writeFileAtomically(options_.out_path + "/" + path, encodeColourPng(image));
    cloud_.setImage(frame, std::move(image));
    Json entry = entryOf(frame, stamp_s);
    entry["file_path"] = path;
    // Trainers take depth only of the very image: cameras apart have lists apart.
    if (std::abs(stamp_s - depth_stamp_s_) < kSameStamp_s) entry["depth_file_path"] = depth_path_;
    frames_.push_back(std::move(entry));
  }

  void finish() {
    const size_t points = cloud_.save(options_.out_path + "/points.ply");
    Json transforms;
    transforms["frames"] = frames_;
    transforms["depth_frames"] = depths_;
    transforms["depth_unit_scale_factor"] = 0.001;
    transforms["ply_file_path"] = "points.ply";
    writeFileAtomically(options_.out_path + "/transforms.json", transforms.dump(1) + "\n");
    std::printf("%zu colour images, %zu depth images, %zu points: %s\n", frames_.size(),
                depths_.size(), points, options_.out_path.c_str());
  }

  static constexpr double kSameStamp_s = 1e-3;

  const ExportOptions& options_;
  JournalReplay& journal_;
  const MapperParams params_;
  Eigen::Isometry3d T_M_W_ = Eigen::Isometry3d::Identity();
  PointCloud cloud_;
  std::vector<Json> frames_, depths_;
  std::string depth_path_;
  double depth_stamp_s_ = -1.0;
};

}  // namespace

void exportJournal(const std::vector<std::string>& arguments) {
  const ExportOptions options = parseExportOptions(arguments);
  JournalReplay journal(options.journal_path);
  if (!journal.cutOff().empty()) {
    std::fprintf(stderr, "map_tool: warning: %s\n", journal.cutOff().c_str());
  }
  if (!options.poses_path.empty()) {
    journal.correctGiven(readTrajectory(options.poses_path, "poses are expected there").poses());
  }
  Exporter(options, journal).writeAll();
}

}  // namespace dtsdf
