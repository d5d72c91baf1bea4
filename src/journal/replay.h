/// Reads a journal, also while it is being written: the images that make up the map, each at its
/// corrected pose, and the calls between them.
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

/// Whether a path is a journal.
bool isJournal(const std::string& path);

/// The effect of a correction.
struct CorrectionEffect {
  size_t moved = 0;                             ///< Depth images that it moves.
  double farthest_m = 0.0, farthest_rad = 0.0;  ///< The largest motion.
};

/// Replays the newest map in a journal: everything since the map was last emptied or loaded. Not
/// thread safe.
///
/// A correction moves the images that it has poses for, and those between; all others move with the
/// first or the last of these. Images after the source of poses has adopted it do not move.
class JournalReplay {
 public:
  /// Reads the journal without its pixels.
  /// @throws std::runtime_error if it is not a journal, or no map begins in it.
  explicit JournalReplay(const std::string& path);

  const journal::Begin& begin() const { return begin_; }
  /// The map into which the first image is fused; null: an empty one.
  std::shared_ptr<const MapChunks> map() const { return map_; }
  /// The last known level of the map.
  const std::optional<Eigen::Isometry3d>& level() const { return T_W_M_; }
  /// Which part of the file cannot be read, in words; empty if none.
  std::string cutOff() const;

  size_t depthImages() const { return depth_images_; }
  /// Records of the map that were read so far.
  uint64_t count() const { return items_.size(); }

  /// Corrects the images so far, and those read later, until this correction itself is read.
  /// @throws std::runtime_error for an invalid correction; nothing has changed then.
  CorrectionEffect correct(const journal::Correction& correction);

  /// Corrects all images with poses in the frame in which poses are given.
  CorrectionEffect correctGiven(std::vector<StampedPose> poses_M);

  /// The motion that corrects the next image.
  Eigen::Isometry3d motion() const;

  /// The first camera's images of the newest recording at their current poses, sorted by stamp,
  /// each once.
  std::vector<StampedPose> firstCamera() const {
    return firstCamera(beginOfRecording(count()), count());
  }

  /// Reads what was appended since. @return whether anything was.
  bool readOn();

  /// The next image or region to empty; none at the end of what was read.
  /// @throws std::runtime_error if a record is damaged.
  std::optional<journal::Call> next();

 private:
  struct Item {
    size_t record;
    double stamp_s = 0.0;                                          ///< For images only, as below.
    Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();       ///< The corrected pose.
    bool is_image = false, is_depth = false, is_of_first = false;  ///< Last: depth of camera 0.
  };
  /// A correction that is being applied to one image after the other.
  struct Running {
    PoseCorrection poses;
    GivenMotion given = {};
    bool is_adopted = false;  ///< Whether the source of poses has adopted it.
  };

  void findBegin();
  void takeBegin(size_t record);
  bool isWhole(size_t record) const;
  void add(size_t record);
  static Eigen::Isometry3d correctNext(Running& running, const Item& item);
  size_t beginOfRecording(uint64_t before) const;
  std::vector<StampedPose> firstCamera(size_t pass, uint64_t before) const;

  std::shared_ptr<RecordFile> file_;
  size_t next_record_ = 0;  ///< The first that is not read yet.
  journal::Begin begin_;
  std::shared_ptr<const MapChunks> map_;
  std::optional<Eigen::Isometry3d> T_W_M_;
  std::vector<Item> items_;
  std::optional<Running> running_;
  size_t depth_images_ = 0, next_ = 0;
};

/// Creates a mapper with the map at the beginning of a journal.
std::unique_ptr<Mapper> mapperOf(const JournalReplay& journal, const MapperParams& params);

/// Repeats a call on a mapper. @return the result for depth and colour, kFused for a region.
IntegrationResult repeatCall(const journal::Call& call, Mapper& mapper);

}  // namespace dtsdf
