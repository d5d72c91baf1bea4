// map_tool export: exports the images of a journal, the node's record of its input, for training
// NeRFs and Gaussian splats.
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "backend/frame_check.h"
#include "io/atomic_file.h"
#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "io/ply.h"
#include "journal/replay.h"
#include "params/text.h"
#include "program/run_program.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

using Json = nlohmann::json;

/// Rows of the pose matrix for a camera with OpenGL axes: x right, y up, z backward.
Json openGlPose(const Eigen::Isometry3d& T_W_C) {
  Eigen::Matrix4d T = T_W_C.matrix();
  T.block<4, 2>(0, 1) *= -1.0;
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) rows.push_back({T(row, 0), T(row, 1), T(row, 2), T(row, 3)});
  return rows;
}

template <class Frame>
Json entryOf(const Frame& frame, double stamp_s) {
  const Intrinsics& K = frame.intrinsics;
  return {{"camera_model", "PINHOLE"},
          {"w", frame.width},
          {"h", frame.height},
          {"fl_x", K.fx},
          {"fl_y", K.fy},
          {"cx", K.cx + 0.5f},  // relative to the corner of the first pixel
          {"cy", K.cy + 0.5f},
          {"transform_matrix", openGlPose(frame.T_W_C)},
          {"stamp", stamp_s}};
}

DepthImage millimetresOf(const DepthFrame& frame) {
  DepthImage image{frame.width, frame.height, {}};
  constexpr float kMax = std::numeric_limits<uint16_t>::max() - 1;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      const float mm = std::floor(1000.0f * frame.unit_m * rawDepth(frame, u, v) + 0.5f);
      image.values.push_back(static_cast<uint16_t>(mm > 0.0f && mm <= kMax ? mm : 0.0f));
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
        image.values.push_back(pixel[byte]);
      }
    }
  }
  return image;
}

/// Writes the vertices of a mesh as points.
void writePoints(const Mesh& mesh, const std::string& path) {
  AtomicFile file(path);
  file.write(plyHeader(mesh.vertices_m.size(), 0, isFarFromOrigin(mesh)));
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    writePlyVertex(mesh, i, MeshColour::kImage, file);
  }
  file.commit();
}

/// Writes a journal's images while fusing them. @return the lists of images, for transforms.json.
Json writeImages(JournalReplay& journal, Mapper& mapper, const std::string& out_path) {
  Json frames = Json::array(), depth_frames = Json::array();
  double depth_stamp_s = -1.0;
  while (const std::optional<journal::Call> call = journal.next()) {
    repeatCall(*call, mapper);
    const auto* const image = std::get_if<journal::Image>(&*call);
    if (image == nullptr) continue;
    Json entry =
        std::visit([&](const auto& frame) { return entryOf(frame, image->stamp_s); }, image->frame);
    if (const auto* const depth = std::get_if<DepthFrame>(&image->frame)) {
      const std::string path = formatted("depth/%06zu.png", depth_frames.size());
      writeFileAtomically(out_path + "/" + path, encodeDepthPng(millimetresOf(*depth)));
      entry["depth_file_path"] = path;
      depth_stamp_s = image->stamp_s;
      depth_frames.push_back(std::move(entry));
      continue;
    }
    const std::string path = formatted("images/%06zu.png", frames.size());
    writeFileAtomically(out_path + "/" + path,
                        encodeColourPng(rgbOf(std::get<ColourFrame>(image->frame))));
    entry["file_path"] = path;
    // Trainers use a depth image only with a colour image; depth_frames lists all depth images.
    if (std::abs(image->stamp_s - depth_stamp_s) < PoseCorrection::kSameStamp_s) {
      entry["depth_file_path"] = depth_frames.back()["depth_file_path"];
    }
    frames.push_back(std::move(entry));
  }
  return {{"frames", frames}, {"depth_frames", depth_frames}, {"depth_unit_scale_factor", 0.001}};
}

}  // namespace

void exportJournal(const std::vector<std::string>& arguments) {
  std::string journal_path, out_path, poses_path;
  CommandLine line(
      "map_tool export", "JOURNAL --transforms OUT [options]",
      "Writes the images of a journal into a folder: images/ (PNG), depth/ (16-bit PNG, "
      "millimetres), points.ply (the vertices of its mesh) and transforms.json, with cameras and "
      "poses in the format that NeRF and splat trainers read (OpenGL axes, map frame).");
  line.addText({"JOURNAL", "", "a journal written by the node"}, journal_path);
  line.addText({"--transforms", "OUT", "folder to write"}, out_path);
  line.require("--transforms");
  line.addText({"--poses", "FILE", "corrected poses, as for reconstruct"}, poses_path);
  line.parse(arguments);
  JournalReplay journal(journal_path);
  if (!journal.incompleteEnd().empty()) {
    std::fprintf(stderr, "map_tool: warning: %s\n", journal.incompleteEnd().c_str());
  }
  if (!poses_path.empty()) {
    journal.correctGiven(readTrajectory(poses_path, "expected a file with poses").poses());
  }
  const MapperParams params = readMapperParams(journal.begin().settings);
  const std::unique_ptr<Mapper> mapper = mapperOf(journal, params);
  Json transforms = writeImages(journal, *mapper, out_path);
  const Mesh mesh = meshOf(*mapper, params.map.voxel_size_m);
  const size_t points = mesh.vertices_m.size();
  if (points > 0) {
    writePoints(mesh, out_path + "/points.ply");
    transforms["ply_file_path"] = "points.ply";
  }
  writeFileAtomically(out_path + "/transforms.json", transforms.dump(1) + "\n");
  std::printf("%zu colour images, %zu depth images, %zu points: %s\n", transforms["frames"].size(),
              transforms["depth_frames"].size(), points, out_path.c_str());
}

}  // namespace dtsdf
