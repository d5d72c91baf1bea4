/// Reads a journal, even while it is being written, and returns the changes to the map: the images,
/// each at its corrected pose, and the cleared regions between them.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "io/map_chunks.h"
#include "journal/pose_correction.h"
#include "journal/records.h"

namespace dtsdf {

/// Whether the file at `path` is a journal.
bool isJournal(const std::string& path);

/// The effect of a correction.
struct CorrectionEffect {
  size_t moved = 0;                             ///< Number of depth images whose pose changes.
  double farthest_m = 0.0, farthest_rad = 0.0;  ///< Largest change of a pose.
};

/// Replays a journal. Not thread-safe.
///
/// A correction applies to the newest recording, as PoseCorrection describes, until the source of
/// poses adopts it.
class JournalReplay {
 public:
  /// Reads the journal without its pixels.
  /// @throws std::runtime_error if it is not a journal, or if its beginning is incomplete.
  explicit JournalReplay(const std::string& path);

  const journal::Begin& begin() const { return begin_; }
  /// The map into which the first image is fused; null if it is empty.
  std::shared_ptr<const MapChunks> map() const { return map_; }
  /// The map's newest levelling transform; std::nullopt if the map is not levelled.
  const std::optional<Eigen::Isometry3d>& level() const { return T_W_M_; }
  /// Describes the incomplete end of the file, which is ignored; empty if it is complete.
  std::string incompleteEnd() const;

  size_t depthImages() const { return depth_images_; }
  /// Number of journal::Calls read so far, since the beginning of the map.
  uint64_t count() const { return items_.size(); }

  /// Corrects the images read so far, and those read from now on until the journal's next
  /// correction.
  /// @throws std::runtime_error, without changing anything, if the correction is invalid.
  CorrectionEffect correct(const journal::Correction& correction);

  /// Like correct(), for a correction that arrives after all calls so far.
  /// @param poses_M Corrected poses in the frame M of the input poses.
  CorrectionEffect correctGiven(std::vector<StampedPose> poses_M);

  /// The correction for images after the last one read; the identity if none applies.
  Eigen::Isometry3d motion() const;

  /// The current poses of the first camera's depth images in the newest recording, sorted by stamp.
  std::vector<StampedPose> firstCamera() const {
    return firstCamera(beginOfRecording(count()), count());
  }

  /// Reads records that were appended since the last call. @return whether any were appended.
  bool readAppended();

  /// The next image to fuse or paint, or region to clear; std::nullopt after the last record read.
  /// @throws std::runtime_error if a record is damaged.
  std::optional<journal::Call> next();

 private:
  struct Item {
    size_t record;
    double stamp_s = 0.0;                                     ///< For images only, like T_W_C.
    Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();  ///< The corrected pose.
    /// `is_first_camera` is true for depth images of camera 0.
    bool is_image = false, is_depth = false, is_first_camera = false;
  };
  /// The correction that applies to the next image read.
  struct Running {
    PoseCorrection poses;
    GivenMotion given = {};
    bool is_adopted = false;  ///< Whether the source of poses has adopted it.
  };

  bool isWhole(size_t record) const;
  void add(size_t record);
  static Eigen::Isometry3d correctNext(Running& running, const Item& item);
  size_t beginOfRecording(uint64_t before) const;
  std::vector<StampedPose> firstCamera(size_t pass, uint64_t before) const;

  std::shared_ptr<RecordFile> file_;
  size_t next_record_ = 1;  ///< First record that has not been read yet.
  journal::Begin begin_;
  std::shared_ptr<const MapChunks> map_;
  std::optional<Eigen::Isometry3d> T_W_M_;
  std::vector<Item> items_;
  std::optional<Running> running_;
  size_t depth_images_ = 0, next_ = 0;
};

/// Creates a mapper with the map at the beginning of a journal.
std::unique_ptr<Mapper> mapperOf(const JournalReplay& journal, const MapperParams& params);

/// Repeats a call to a mapper. @return the result for depth and colour, kFused for a region.
IntegrationResult repeatCall(const journal::Call& call, Mapper& mapper);

}  // namespace dtsdf
