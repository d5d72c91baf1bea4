/// Fuses the images of a journal once more, at corrected poses, beside the map as it is.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "journal/replay.h"

namespace dtsdf {

/// In turns: each step() does a little, so that images that come meanwhile go first.
class Refusion {
 public:
  /// Opens the journal and makes the map to begin with.
  /// @param run Where and on how many threads; all other settings are the journal's.
  /// @throws std::runtime_error if the journal cannot be read, or refuses the correction.
  Refusion(const std::string& path, const MapperParams& run, journal::Correction correction);

  const journal::Correction& correction() const { return correction_; }
  const CorrectionEffect& effect() const { return effect_; }

  /// Does the next record of the journal, or reads what was added to it.
  /// @param live_bytes Those of the map as it is: both together stay within map/max_memory_mb.
  /// @return whether it did something; if not, it has caught up with the journal as it is written.
  /// @throws std::runtime_error if there is too little memory, or the journal is damaged.
  bool step(size_t live_bytes);

  size_t fused() const { return fused_; }                 ///< Depth images fused.
  size_t total() const { return replay_.depthImages(); }  ///< Depth images known of.
  size_t bytes() const { return bytes_; }                 ///< Size of the map, when last measured.
  /// Records of the journal that it has done, once step() has nothing to do.
  uint64_t count() const { return replay_.count(); }
  /// What an image that is not in the journal yet would be moved by.
  Eigen::Isometry3d motion() const { return replay_.motion(); }

  /// See JournalReplay.
  std::vector<StampedPose> firstCamera() const { return replay_.firstCamera(); }

  /// The mesh of the whole map, by packed key. Brings it up to date.
  const std::map<PackedKey, SharedBlockMesh>& takeMesh();
  std::unique_ptr<Mapper> takeMapper() { return std::move(mapper_); }

 private:
  void extract();
  void checkMemory(size_t live_bytes);

  JournalReplay replay_;
  journal::Correction correction_;
  CorrectionEffect effect_;
  std::unique_ptr<Mapper> mapper_;
  MeshStore mesh_{1.0f};  ///< Only its blocks.
  size_t fused_ = 0, bytes_ = 0, calls_since_mesh_ = 0;
};

/// Why a second map of so many bytes does not fit into the budget beside the live one; empty if it
/// does.
std::string whyTooLarge(size_t live_bytes, size_t second_bytes, size_t max_bytes);

}  // namespace dtsdf
