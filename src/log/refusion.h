/// Has a mapper do what is in a log, each image at its corrected pose: once, or beside the map as
/// it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "dtsdf_mapping/mapper.h"
#include "log/logged_poses.h"

namespace dtsdf {

/// An image, or a region that was emptied.
struct LogCall {
  std::variant<LoggedDepth, LoggedColour, Region> content;
  double stamp_s = 0.0;  ///< Of an image.
  uint64_t number = 0;   ///< Of the record.
};

/// What is in a log, for a mapper: each image at its corrected pose, and the calls between them.
/// One thread at a time.
class LogReplay {
 public:
  /// Reads the whole log, but for the pixels. @throws std::runtime_error as LogReader does.
  explicit LogReplay(const std::string& folder);

  const LogReader& log() const { return reader_; }
  const LoggedPoses& poses() const { return poses_; }

  /// The settings of the mapper; where it runs is not among them.
  const ParamTree& settings() const { return reader_.begin().settings; }

  // As of LoggedPoses. What was handed out at other poses stays so: see startOver().
  CorrectionEffect effectOf(const LogCorrection& correction) const;
  CorrectionEffect correct(const LogCorrection& correction);

  /// Hands out all again that has gone into the newest map of the log which has nothing of the
  /// record with this number or later ones. @return the file of that map; empty: it is empty.
  std::string startOver(uint64_t number);

  /// Reads what was logged since. @return whether there was something.
  bool readOn();

  /// What comes next; nothing at the end of what was read. @throws std::runtime_error for a record
  /// that is damaged.
  std::optional<LogCall> next();

  /// Level of the map, as it was known last.
  const std::optional<Eigen::Isometry3d>& level() const { return T_W_M_; }

  /// Those that are handed out, from the start on.
  size_t depthImages() const { return depth_images_; }

  /// The number of the record that comes after those so far.
  uint64_t nextNumber() const;
  /// Whether one with this number was handed out.
  bool isHandedOut(uint64_t number) const;

 private:
  void outdate(const LogCorrection& correction);

  LogReader reader_;
  LoggedPoses poses_;
  std::optional<Eigen::Isometry3d> T_W_M_;
  std::vector<LogBase> bases_;  ///< Those of the log that no correction in it has outdated.
  size_t bases_read_;           ///< How many of the log there are to it so far.
  size_t depth_images_ = 0;
  size_t next_ = 0;
};

/// Has a mapper do what the call was. Colours and depth give their result, a region kFused.
IntegrationResult apply(const LogCall& call, Mapper& mapper);

/// Fuses the images of a log once more, at their corrected poses, beside the map as it is. In
/// turns: each step() does a little, so that images that come meanwhile go first.
class Refusion {
 public:
  /// @param run Where and on how many threads; all other settings are the log's.
  /// @throws std::runtime_error if the log cannot be read.
  Refusion(const std::string& log_folder, const MapperParams& run);

  /// What a correction would do. @throws std::runtime_error if it is refused, or the log lacks what
  /// it corrects.
  CorrectionEffect effectOf(const LogCorrection& correction);
  /// Whether images that it moves were fused already, so that all begins again with it.
  bool isTooLateFor(const CorrectionEffect& effect) const;
  /// Corrects images, those too that are added to the log later. @throws as effectOf().
  void correct(LogCorrection correction);

  /// Whether begin() is needed: at first, and after a correction that has come too late.
  bool hasToBegin() const { return has_to_begin_; }
  /// Makes the map that the first image which moves goes into: the newest one of the log that has
  /// no later image. Frees the one so far. Takes long where either is large.
  /// @throws std::runtime_error if it cannot be made.
  void begin();

  /// Does the next record of the log, or reads what was added to it. @pre Not hasToBegin().
  /// @param live_bytes Those of the map as it is: both together stay within map/max_memory_mb.
  /// @return whether it did something; if not, it has caught up with the log as it is written.
  /// @throws std::runtime_error if there is too little memory, or the log is damaged.
  bool step(size_t live_bytes);

  /// The corrections, as the log is to have them.
  const std::vector<LogCorrection>& corrections() const { return corrections_; }
  /// What an image that is not in the log yet would be moved by.
  Eigen::Isometry3d motion() const { return replay_.poses().motion(); }
  /// Where the first camera's images are by now: see LoggedPoses.
  std::vector<StampedPose> firstCamera() const {
    return replay_.poses().firstCamera(replay_.nextNumber());
  }
  size_t fused() const { return fused_; }                 ///< Depth images, since it began.
  size_t total() const { return replay_.depthImages(); }  ///< Of those that are known of.
  size_t bytes() const { return bytes_; }                 ///< Of the map, when last looked at.
  /// Number of the record that comes next, once step() has nothing to do.
  uint64_t nextNumber() const { return replay_.nextNumber(); }

  /// The mesh of the whole map, by packed key. Brings it up to date.
  std::map<PackedKey, BlockMesh> takeMesh();
  std::unique_ptr<Mapper> takeMapper() { return std::move(mapper_); }

 private:
  void fuse(const LogCall& call);
  void extract();
  void checkMemory(size_t live_bytes);
  void readUpTo(uint64_t number);

  LogReplay replay_;
  MapperParams params_;
  std::vector<LogCorrection> corrections_;
  std::unique_ptr<Mapper> mapper_;
  std::map<PackedKey, BlockMesh> mesh_;
  bool has_to_begin_ = true;
  size_t fused_ = 0, bytes_ = 0;
  size_t calls_since_mesh_ = 0;
};

/// Why a second map beside one of so many bytes would not fit; empty if it may.
std::string whyTooLarge(const MapStats& live);

}  // namespace dtsdf
