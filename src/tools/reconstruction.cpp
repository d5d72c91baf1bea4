#include "tools/reconstruction.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "dtsdf_mapping/io/rate_limit.h"
#include "level/pose_convention.h"
#include "params/text.h"
#include "program/stopwatch.h"

namespace dtsdf {
namespace {

/// Runs `action`. @return its wall time in milliseconds.
template <class Action>
double timeMs(const Action& action) {
  const auto begin = std::chrono::steady_clock::now();
  action();
  return millisecondsSince(begin);
}

/// The state of one run.
class Reconstruction {
 public:
  /// @param input Null for a journal, whose poses are used unchanged.
  Reconstruction(Mapper& mapper, const MapParams& map, const RecordedInput* input = nullptr)
      : mapper_(mapper), meshes_(std::make_shared<PagedMeshes>(map)) {
    if (input == nullptr) return;
    box_ = input->box;
    supporting_ = input->supporting;
    seeks_ = input->map_stamp_s.has_value();
    if (input->poses.mode == PoseMode::kRefine) refiner_.emplace(input->poses);
    if (input->poses.mode == PoseMode::kTrack) tracker_.emplace(input->poses, input->threads);
  }

  void paint(const SourceColour& source) {
    ColourFrame image = source.colour;
    if (!placeImage(image, source.stamp_s)) return;
    IntegrationResult painting;
    result_.paint_ms.push_back(timeMs([&] { painting = mapper_.paint(image); }));
    if (painting.status == FrameStatus::kFused) {
      ++result_.images;
      result_.stamp_s = std::max(result_.stamp_s, source.stamp_s);  // a frame may be newer
    } else {
      ++result_.skipped[std::string("colour images: ") + toString(painting.status)];
    }
    painted_since_mesh_ = true;
  }

  void fuse(const SourceFrame& frame) {
    ++frames_seen_;
    ++frames_since_mesh_;
    DepthFrame depth = frame.depth;
    if (!tracker_) convention_.add(depth);
    if (!findPose(depth, frame.stamp_s)) return;
    const uint64_t supporting = box_ != nullptr ? supporting_() : 0;
    IntegrationResult integration;
    result_.integrate_ms.push_back(timeMs([&] { integration = mapper_.integrate(depth); }));
    if (integration.status == FrameStatus::kFused) {
      ++result_.frames;
      result_.stamp_s = frame.stamp_s;
      result_.trajectory.push_back({frame.stamp_s, depth.T_W_C});
      if (box_ != nullptr) note(frame.index, supporting_() > supporting);
    } else {
      ++result_.skipped[toString(integration.status)];
      result_.problems.emplace(toString(integration.status), integration.message);
    }
  }

  void clearRegion(const Region& region) {
    mapper_.clearRegion(region);
    painted_since_mesh_ = true;
  }

  void updateMeshIfDue(size_t mesh_every) {
    if (frames_since_mesh_ >= mesh_every) updateMesh();
  }

  size_t framesSeen() const { return frames_seen_; }

  ReconstructionResult finish(const std::map<std::string, size_t>& skipped_by_source,
                              std::map<std::string, std::string> problems = {}) {
    result_.problems.merge(problems);
    for (const auto& [reason, count] : skipped_by_source) result_.skipped[reason] += count;
    const auto refined = static_cast<double>(std::max<size_t>(1, result_.shift_mm.size()));
    result_.on_surfaces_before /= refined;
    result_.on_surfaces /= refined;
    result_.map = mapper_.stats();
    if (box_ != nullptr) return std::move(result_);
    result_.doubt = convention_.doubt();
    if (result_.frames == 0) {
      const std::string reasons = describeSkipped(result_.skipped, result_.problems);
      throw std::runtime_error("no frame was fused (" +
                               (reasons.empty() ? "none was selected" : reasons) +
                               "), so there is no mesh to save");
    }
    if (frames_since_mesh_ > 0 || painted_since_mesh_) updateMesh();
    result_.map = mapper_.stats();
    result_.meshes = std::move(meshes_);
    return std::move(result_);
  }

 private:
  /// Refines or tracks the pose. @return whether to fuse the frame.
  bool findPose(DepthFrame& depth, double stamp_s) {
    if (!refiner_ && !tracker_) return true;
    if (tracker_ && std::exchange(seeks_, false)) tracker_->seek(depth.T_W_C, stamp_s);
    Alignment alignment;
    result_.align_ms.push_back(timeMs([&] {
      alignment =
          refiner_ ? refiner_->refine(mapper_, depth) : tracker_->track(mapper_, depth, stamp_s);
    }));
    // The first image cannot be aligned to an empty map.
    const bool is_first = alignment.status == AlignmentStatus::kUnmapped && result_.frames == 0;
    ++result_.aligned[is_first ? "first image" : toString(alignment.status)];
    if (refiner_ && alignment.status == AlignmentStatus::kAligned) noteMove(depth, alignment);
    depth.T_W_C = alignment.T_W_C;
    if (refiner_ ? refiner_->shouldFuse(alignment) : tracker_->shouldFuse(alignment)) return true;
    ++result_.skipped[toString(alignment.status)];
    recordLoss(alignment, stamp_s);
    return false;
  }

  void recordLoss(const Alignment& alignment, double stamp_s) {
    if (result_.lost.empty() || result_.lost.back().fused_before != result_.frames) {
      const std::string why =
          formatted("%s: %.0f %% of the points lie near surfaces, %.0f %% of these are inliers%s",
                    toString(alignment.status), 100.0 * alignment.matched_share,
                    100.0 * alignment.inlier_share,
                    alignment.is_held ? "" : ", and the pose may slide along them");
      result_.lost.push_back({stamp_s, result_.frames, 0, why});
    }
    ++result_.lost.back().images;
  }

  void noteMove(const DepthFrame& given, const Alignment& alignment) {
    constexpr double kDegrees = 180.0 / 3.14159265358979323846;
    const Eigen::AngleAxisd turn(alignment.T_W_C.linear() * given.T_W_C.linear().transpose());
    const double shift_m = (alignment.T_W_C.translation() - given.T_W_C.translation()).norm();
    result_.shift_mm.push_back(1e3 * shift_m);
    result_.turn_degrees.push_back(kDegrees * turn.angle());
    // finish() divides these sums.
    result_.on_surfaces_before += alignment.compared_share;
    result_.on_surfaces += alignment.matched_share * alignment.inlier_share;
  }

  void note(size_t index, bool is_supporting) {
    const uint64_t number = frameNumber(box_->box, index);
    appendIndex(number, box_->box.fused);
    if (is_supporting) appendIndex(number, box_->box.supporting);
  }

  /// Converts the pose of a colour image to the map frame. @return false if the pose is unknown.
  bool placeImage(ColourFrame& image, double stamp_s) {
    if (refiner_) image.T_W_C = refiner_->T_W_O() * image.T_W_C;
    if (!tracker_) return true;
    const std::optional<Eigen::Isometry3d> T_W_D = tracker_->poseAt(stamp_s);
    if (T_W_D) {
      image.T_W_C = *T_W_D * image.T_W_C;
    } else {
      ++result_.skipped["colour images: the camera is lost"];
    }
    return T_W_D.has_value();
  }

  void updateMesh() {
    result_.mesh_ms.push_back(timeMs([&] { meshes_->update(mapper_); }));
    frames_since_mesh_ = 0;
    painted_since_mesh_ = false;
  }

  Mapper& mapper_;
  std::shared_ptr<PagedMeshes> meshes_;
  BoxRun* box_ = nullptr;  ///< Null if the run builds the whole map.
  std::function<uint64_t()> supporting_;
  // Neither is set if poses are used unchanged.
  std::optional<PoseRefiner> refiner_;
  std::optional<PoseTracker> tracker_;
  bool seeks_ = false;  ///< Whether the camera must first be located in a loaded map.
  PoseConvention convention_;
  ReconstructionResult result_;
  size_t frames_seen_ = 0;
  size_t frames_since_mesh_ = 0;
  bool painted_since_mesh_ = false;
};

}  // namespace

std::string describeSkipped(const std::map<std::string, size_t>& skipped,
                            const std::map<std::string, std::string>& problems) {
  std::string text;
  for (const auto& [reason, count] : skipped) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " x " + reason;
    const auto problem = problems.find(reason);
    if (problem != problems.end()) text += " (" + problem->second + ")";
  }
  return text;
}

ReconstructionResult reconstruct(const RecordedInput& input, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress) {
  Reconstruction reconstruction(mapper, map, &input);
  RateLimit rate_limit(input.max_colour_rate_hz);
  size_t over_rate = 0;
  std::optional<SourceColour> image;  // the next image, read ahead
  const auto readImage = [&] {
    image = input.colour == nullptr ? std::nullopt : input.colour->next();
    for (; image && !rate_limit.takes(image->stamp_s); image = input.colour->next()) ++over_rate;
  };
  readImage();
  // Paints with all images whose stamps are at most `stamp_s`.
  const auto paintUpTo = [&](double stamp_s) {
    for (; image && image->stamp_s <= stamp_s; readImage()) reconstruction.paint(*image);
  };
  bool is_first = true;
  while (const std::optional<SourceFrame> frame = input.depth.next()) {
    for (; image && image->stamp_s < frame->stamp_s; readImage()) {
      const bool follows_map = input.map_stamp_s && image->stamp_s > *input.map_stamp_s;
      if (!is_first || follows_map || input.box != nullptr) reconstruction.paint(*image);
    }
    is_first = false;
    reconstruction.fuse(*frame);
    paintUpTo(frame->stamp_s);
    if (mesh_every > 0) reconstruction.updateMeshIfDue(mesh_every);
    show_progress(reconstruction.framesSeen());
  }
  if (input.box != nullptr) paintUpTo(input.box->last_stamp_s);
  std::map<std::string, size_t> skipped = input.depth.skipped();
  std::map<std::string, std::string> problems = input.depth.problems();
  if (input.colour != nullptr) {
    for (const auto& [reason, count] : input.colour->skipped()) skipped[reason] += count;
    problems.merge(input.colour->problems());
    if (over_rate > 0) skipped["colour images: over_rate"] = over_rate;
  }
  return reconstruction.finish(skipped, problems);
}

ReconstructionResult reconstruct(JournalReplay& journal, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress) {
  Reconstruction reconstruction(mapper, map);
  while (std::optional<journal::Call> call = journal.next()) {
    const auto* const image = std::get_if<journal::Image>(&*call);
    if (image == nullptr) {
      reconstruction.clearRegion(std::get<Region>(*call));
    } else if (const auto* const depth = std::get_if<DepthFrame>(&image->frame)) {
      SourceFrame frame;
      frame.depth = *depth;
      frame.stamp_s = image->stamp_s;
      reconstruction.fuse(frame);
      if (mesh_every > 0) reconstruction.updateMeshIfDue(mesh_every);
      show_progress(reconstruction.framesSeen());
    } else {
      SourceColour colour;
      colour.colour = std::get<ColourFrame>(image->frame);
      colour.stamp_s = image->stamp_s;
      reconstruction.paint(colour);
    }
  }
  return reconstruction.finish({});
}

}  // namespace dtsdf
