/// The images of a log and their poses, by all corrections so far.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "log/corrected_poses.h"
#include "log/log_reader.h"

namespace dtsdf {

/// Why images before the first one of a log cannot be moved.
std::string reachesBack(double stamp_s, double first_s);

/// What a correction does.
struct CorrectionEffect {
  size_t moved = 0;  ///< Depth images.
  /// Number of the first image that moves; that of the next if none does.
  uint64_t first_moved = 0;
  double farthest_m = 0.0, farthest_rad = 0.0;  ///< Of them.
};

/// The records of a log one after the other, each with the pose that its image has by now.
///
/// A correction moves the images that its poses are of and those between, and with the first and
/// the last of them all others, but not those after the source of poses has taken it over.
class LoggedPoses {
 public:
  struct Item {
    LogEntry entry;
    LogImage image;           ///< As it was logged; of an image only.
    Eigen::Isometry3d T_W_C;  ///< As corrected.
    bool is_image = false;
  };

  /// Adds a record; one that is a correction is applied. @throws std::runtime_error if malformed.
  void add(LogEntry entry);

  /// What correct() would do. @throws std::runtime_error, as PoseCorrection does, and if it reaches
  /// back to images that are no longer in the log.
  CorrectionEffect effectOf(const LogCorrection& correction, bool has_lost_images) const {
    return plan(correction, has_lost_images).effect;
  }

  /// Corrects the images so far, and those that are added after this. @throws as effectOf();
  /// everything is as it was then.
  CorrectionEffect correct(const LogCorrection& correction, bool has_lost_images);

  /// What the next image would be moved by.
  Eigen::Isometry3d motion() const;

  /// The first camera's depth images with numbers before this, as far as they can be corrected: of
  /// the newest recording. By stamp, each once.
  std::vector<StampedPose> firstCamera(uint64_t before) const;

  const std::vector<Item>& items() const { return items_; }

 private:
  /// A correction on its way along the images.
  struct Running {
    PoseCorrection poses;
    GivenMotion given = {};
    bool is_taken_over = false;  ///< By the source of poses.
  };
  struct Plan {
    Running running;
    CorrectionEffect effect;
    std::vector<std::pair<size_t, Eigen::Isometry3d>> moves;  ///< Items and their new poses.
  };

  static Eigen::Isometry3d correctNext(Running& running, const Item& item);
  Plan plan(const LogCorrection& correction, bool has_lost_images) const;
  size_t beginOfPass(uint64_t before) const;

  std::vector<Item> items_;
  std::vector<Running> running_;  ///< By correct(), in their order; later images may need them.
};

}  // namespace dtsdf
