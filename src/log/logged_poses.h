/// The images of a log and their poses, by all corrections so far.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "log/corrected_poses.h"
#include "log/log_reader.h"

namespace dtsdf {

/// What a correction did.
struct CorrectionEffect {
  size_t moved = 0;  ///< Depth images.
  /// Number of the first image that moved; that of the next if none did.
  uint64_t first_moved = 0;
};

/// The records of a log one after the other, each with the pose that its image has by now.
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

  /// Corrects the images with numbers before `correction.before`; and later ones, those that are
  /// added after this too, with stamps up to `until_s`. @throws std::runtime_error, as
  /// PoseCorrection does, and if it reaches back to images that are no longer in the log;
  /// everything is as it was then.
  CorrectionEffect correct(const LogCorrection& correction, bool has_lost_images);

  const std::vector<Item>& items() const { return items_; }

 private:
  size_t beginOfPass(uint64_t before) const;
  CorrectionEffect apply(const PoseCorrection& poses, const LogCorrection& correction, size_t pass);

  std::vector<Item> items_;
  std::optional<PoseCorrection> newest_;  ///< By correct(); later images may need it.
  double until_s_ = 0.0;
};

}  // namespace dtsdf
