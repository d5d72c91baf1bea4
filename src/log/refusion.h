/// Fuses the images of a log once more, at their corrected poses, beside the map as it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "dtsdf_mapping/block_mesh.h"
#include "log/log_replay.h"

namespace dtsdf {

/// In turns: each step() does a little, so that images that come meanwhile go first.
class Refusion {
 public:
  /// @param run Where and on how many threads; all other settings are the log's.
  /// @throws std::runtime_error if the log cannot be read, or the correction is refused.
  Refusion(const std::string& log_folder, const MapperParams& run, const LogCorrection& correction);

  /// Does the next record of the log, or reads what was added to it.
  /// @param live_bytes Those of the map as it is: both together stay within map/max_memory_mb.
  /// @return whether it did something; if not, it has caught up with the log as it is written.
  /// @throws std::runtime_error if there is too little memory, or the log is damaged.
  bool step(size_t live_bytes);

  /// What the correction did to the poses, as the log is to have it.
  const LogCorrection& correction() const { return correction_; }
  size_t moved() const { return effect_.moved; }
  size_t fused() const { return fused_; }                 ///< Depth images so far.
  size_t total() const { return replay_.depthImages(); }  ///< Of those known so far.
  /// Number of the record that comes next, once step() has nothing to do.
  uint64_t nextNumber() const;
  double stamp_s() const { return stamp_s_; }  ///< Of the newest image in the map.

  /// The mesh of the whole map, by packed key. Brings it up to date.
  std::map<PackedKey, BlockMesh> takeMesh();
  std::unique_ptr<Mapper> takeMapper() { return std::move(mapper_); }

 private:
  void make();
  void extract();
  void checkMemory(size_t live_bytes) const;

  LogReplay replay_;
  LogCorrection correction_;
  CorrectionEffect effect_;
  MapperParams params_;
  std::unique_ptr<Mapper> mapper_;
  std::map<PackedKey, BlockMesh> mesh_;
  uint64_t next_number_ = 0;
  size_t fused_ = 0;
  size_t calls_since_mesh_ = 0;
  double stamp_s_ = 0.0;
};

/// Why a second map beside one of so many bytes would not fit; empty if it may.
std::string whyTooLarge(const MapStats& live);

}  // namespace dtsdf
