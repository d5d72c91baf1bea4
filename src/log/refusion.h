/// Fuses the images of a log once more, at their corrected poses, beside the map as it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/block_mesh.h"
#include "log/log_replay.h"

namespace dtsdf {

/// In turns: each step() does a little, so that images that come meanwhile go first.
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
