/// A map that writes its frames and calls to a journal like the node does.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "journal/replay.h"
#include "journal/writer.h"
#include "support/colour_frames.h"
#include "support/depth_frames.h"
#include "support/temporary_folder.h"

namespace dtsdf {

inline MapperParams journaledParams() {
  MapperParams params = makeCpuParams();
  params.map.voxel_size_m = 0.08f;
  params.map.max_memory_mb = 256;
  return params;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Options for a journal of up to 1 GB.
inline JournalWriter::Options journalOptions(const std::string& folder) {
  JournalWriter::Options options;
  options.folder = folder;
  options.max_bytes = 1u << 30;
  return options;
}

inline ParamTree settingsOf(const MapperParams& params) {
  ParamTree tree = toTree(params);
  tree.erase("backend");
  tree.erase("threads");
  return tree;
}

class JournaledMap {
 public:
  JournaledMap(const MapperParams& params, JournalWriter& journal, const PoseParams& poses = {})
      : params_(params), poses_(poses), mapper_(makeMapper(params)), journal_(journal) {
    begin(nullptr);
  }

  void fuse(const SceneFrame& frame, double stamp_s, uint32_t camera = 0) {
    const auto kept = std::make_shared<const SceneFrame>(frame);
    const DepthFrame view = kept->view();
    mapper_->integrate(view);
    journal_.add(journal::Image{stamp_s, camera, view.T_W_C, view, kept});
  }

  void paint(const PaintedFrame& frame, double stamp_s, uint32_t camera = 0) {
    const auto kept = std::make_shared<const PaintedFrame>(frame);
    const ColourFrame view = kept->view();
    mapper_->paint(view);
    journal_.add(journal::Image{stamp_s, camera, view.T_W_C, view, kept});
  }

  void clearRegion(const Region& region) {
    mapper_->clearRegion(region);
    journal_.add(region);
  }

  void load(const std::string& path) {
    const auto file = std::make_shared<const MapChunks>(path);
    mapper_ = makeMapper(params_, partsOf(file));
    begin(file);
  }

  void clear() {
    mapper_->clear();
    begin(nullptr);
  }

  Mapper& mapper() { return *mapper_; }

 private:
  void begin(std::shared_ptr<const MapChunks> map) {
    journal::Begin begin;
    begin.settings = settingsOf(params_);
    begin.poses = poses_;
    begin.map_frame = "map";
    begin.level_frame = "map_level";
    journal_.begin(begin, std::move(map));
  }

  MapperParams params_;
  PoseParams poses_;
  std::unique_ptr<Mapper> mapper_;
  JournalWriter& journal_;
};

/// Contents of the file to which the map is saved.
inline std::string fileOf(Mapper& mapper) {
  const TemporaryFolder folder;
  saveMap(mapper.contents(), folder / "map.dtsdf", 1);
  return readBytes(folder / "map.dtsdf");
}

/// Restores a map from a journal with these parameters. Returns the contents of the file to which
/// the map is saved.
inline std::string mapOf(JournalReplay& journal, const MapperParams& params) {
  const auto mapper = mapperOf(journal, params);
  while (const std::optional<journal::Call> call = journal.next()) repeatCall(*call, *mapper);
  return fileOf(*mapper);
}
inline std::string mapOf(const std::string& path, const MapperParams& params) {
  JournalReplay journal(path);
  return mapOf(journal, params);
}

/// Images of a lap through the room, one every `step_s` seconds.
inline std::vector<SceneFrame> roomImages(int count, double step_s = 0.1) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) poses.push_back(roomCameraPose(step_s * i));
  return renderFrames(makeRoomScene(), poses, 80, 60);
}

/// Returns a copy of a frame with a different pose.
inline SceneFrame withPose(const SceneFrame& frame, const Eigen::Isometry3d& T_W_C) {
  SceneFrame moved = frame;
  moved.frame.T_W_C = T_W_C;
  return moved;
}

}  // namespace dtsdf
