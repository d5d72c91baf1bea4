/// Reads a journal, also while it is written: the images that the map is made of, each at its
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

/// What a correction does.
struct CorrectionEffect {
  size_t moved = 0;                             ///< Depth images that it moves.
  double farthest_m = 0.0, farthest_rad = 0.0;  ///< How far the farthest moves.
};

/// Replays the newest map in a journal: all since it was emptied or loaded last. For one thread at
/// a time.
///
/// A correction moves the images that its poses are of and those between, and with the first and
/// the last of them all others, but not those after the source of poses has taken it over.
class JournalReplay {
 public:
  /// Reads the journal, but for the pixels.
  /// @throws std::runtime_error for what is no journal, or one that does not begin with a map.
  explicit JournalReplay(const std::string& path);

  const journal::Begin& begin() const { return begin_; }
  /// The map that the first image goes into; null: it is empty.
  std::shared_ptr<const MapChunks> map() const { return map_; }
  /// Level of the map, as it was known last.
  const std::optional<Eigen::Isometry3d>& level() const { return T_W_M_; }
  /// What of the file cannot be read, in words; empty if nothing.
  std::string cutOff() const;

  size_t depthImages() const { return depth_images_; }
  /// Records of the map so far.
  uint64_t count() const { return items_.size(); }

  /// Corrects the images so far, and those that are read later, until that correction is read.
  /// @throws std::runtime_error for a correction that makes no sense; all is as it was then.
  CorrectionEffect correct(const journal::Correction& correction);

  /// Corrects all images, by poses in the frame that poses are given in.
  CorrectionEffect correctGiven(std::vector<StampedPose> poses_M);

  /// What the next image would be moved by.
  Eigen::Isometry3d motion() const;

  /// The first camera's images of the newest recording, where they are by now: by stamp, each once.
  std::vector<StampedPose> firstCamera() const {
    return firstCamera(beginOfPass(count()), count());
  }

  /// Reads what was written since. @return whether there was something.
  bool readOn();

  /// The next image or region to empty; nothing at the end of what was read.
  /// @throws std::runtime_error for a record that is damaged.
  std::optional<journal::Call> next();

 private:
  struct Item {
    size_t record;
    double stamp_s = 0.0;                                     ///< For an image, as what follows.
    Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();  ///< As corrected.
    bool is_image = false, is_depth = false, is_of_first = false;  ///< The first camera's depth.
  };
  /// A correction on its way along the images.
  struct Running {
    PoseCorrection poses;
    GivenMotion given = {};
    bool is_taken_over = false;  ///< The source of poses has taken it over.
  };

  void findBegin();
  void takeBegin(size_t record);
  bool isWhole(size_t record) const;
  void add(size_t record);
  static Eigen::Isometry3d correctNext(Running& running, const Item& item);
  size_t beginOfPass(uint64_t before) const;
  std::vector<StampedPose> firstCamera(size_t pass, uint64_t before) const;

  std::shared_ptr<RecordFile> file_;
  size_t next_record_ = 0;  ///< That is not read yet.
  journal::Begin begin_;
  std::shared_ptr<const MapChunks> map_;
  std::optional<Eigen::Isometry3d> T_W_M_;
  std::vector<Item> items_;
  std::optional<Running> running_;
  size_t depth_images_ = 0, next_ = 0;
};

/// A mapper with the map that a journal begins with.
std::unique_ptr<Mapper> mapperOf(const JournalReplay& journal, const MapperParams& params);

/// Has a mapper do what the call was. Colours and depth give their result, a region kFused.
IntegrationResult doAgain(const journal::Call& call, Mapper& mapper);

}  // namespace dtsdf
