/// A map whose frames and calls are logged, as the node does it.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/mapper.h"
#include "log/frame_log.h"
#include "support/colour_frames.h"
#include "support/depth_frames.h"
#include "support/temporary_folder.h"

namespace dtsdf {

inline ParamTree settingsOf(const MapperParams& params) {
  ParamTree tree = toTree(params);
  tree.erase("backend");
  tree.erase("threads");
  return tree;
}

inline FrameLog::Options logOptions(const std::string& folder, uint64_t max_bytes = 1u << 30,
                                    uint64_t segment_bytes = 64u << 10) {
  return {folder, max_bytes, segment_bytes, nullptr};
}

class LoggedMap {
 public:
  LoggedMap(const MapperParams& params, FrameLog& log, const PoseParams& poses = PoseParams())
      : params_(params), poses_(poses), mapper_(makeMapper(params)), log_(log) {
    begin(nullptr, false);
  }

  void begin(const WriteMap& write_map, bool continues) {
    LogBegin begin;
    begin.settings = settingsOf(params_);
    begin.poses = poses_;
    begin.map_frame = "map";
    begin.continues = begin.stands_for_lost = continues;
    log_.begin(begin, write_map);
  }

  /// A new stretch with the map as it is.
  void checkpoint() {
    begin(writerOf(std::make_shared<const MapContents>(mapper_->contents())), true);
  }

  void fuse(const SceneFrame& frame, double stamp_s, uint32_t camera = 0) {
    const DepthFrame view = frame.view();
    mapper_->integrate(view);
    log_.add(toRecord(view, stamp_s, camera), stamp_s);
  }

  void paint(const PaintedFrame& frame, double stamp_s, uint32_t camera = 0) {
    const ColourFrame view = frame.view();
    mapper_->paint(view);
    log_.add(toRecord(view, stamp_s, camera), stamp_s);
  }

  void clearRegion(const Region& region) {
    mapper_->clearRegion(region);
    log_.add(toRecord(region));
  }

  void load(std::shared_ptr<const MapContents> contents) {
    mapper_ = makeMapper(params_, *contents);
    begin(writerOf(std::move(contents)), false);
  }

  void clear() {
    mapper_->clear();
    begin(nullptr, false);
  }

  Mapper& mapper() { return *mapper_; }

 private:
  MapperParams params_;
  PoseParams poses_;
  std::unique_ptr<Mapper> mapper_;
  FrameLog& log_;
};

/// The bytes of a map's file: equal for equal maps, and for no others.
inline std::string fileOf(Mapper& mapper) {
  const TemporaryFolder folder;
  saveMap(mapper.contents(), folder / "map.dtsdf", 1);
  return readBytes(folder / "map.dtsdf");
}

/// Images of the room along a lap, at most 0.1 s apart.
inline std::vector<SceneFrame> roomImages(int count, double step_s = 0.1) {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i) poses.push_back(roomCameraPose(step_s * i));
  return renderFrames(makeRoomScene(), poses, 80, 60);
}

/// The same image elsewhere.
inline SceneFrame movedTo(const SceneFrame& frame, const Eigen::Isometry3d& T_W_C) {
  SceneFrame moved = frame;
  moved.frame.T_W_C = T_W_C;
  return moved;
}

}  // namespace dtsdf
