/// Fuses a journal's images again at corrected poses, into a second map.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/mesh.h"
#include "journal/replay.h"

namespace dtsdf {

/// Works in small steps, between which new images can be fused into the live map.
class Refusion {
 public:
  /// Opens the journal and, if the correction moves any depth image, creates the map with which the
  /// journal begins.
  /// @param run Determines the backend and the number of threads; all other settings come from the
  /// journal.
  /// @throws std::runtime_error if the journal cannot be read or the correction is invalid.
  Refusion(const std::string& path, const MapperParams& run, journal::Correction correction);

  const journal::Correction& correction() const { return correction_; }
  const CorrectionEffect& effect() const { return effect_; }

  /// Repeats the next journal::Call or, at the end of the journal, updates the mesh.
  /// @param live_bytes Size of the live map; both maps must fit into map/max_memory_mb.
  /// @return false if there was nothing left to do, since all calls in the journal have been
  /// repeated.
  /// @throws std::runtime_error if there is too little memory, or the journal is damaged.
  bool step(size_t live_bytes);

  size_t fused() const { return fused_; }  ///< Depth images fused.
  size_t bytes() const { return bytes_; }  ///< Size of the map when last measured.
  /// The journal as read so far; once step() returns false, all of its calls have been repeated.
  const JournalReplay& replay() const { return replay_; }

  /// Updates the mesh of the whole map and returns its blocks, by packed key.
  const std::map<PackedKey, SharedBlockMesh>& takeMesh();
  std::unique_ptr<Mapper> takeMapper() { return std::move(mapper_); }

 private:
  void extract();
  void checkMemory(size_t live_bytes);

  JournalReplay replay_;
  journal::Correction correction_;
  CorrectionEffect effect_;
  std::unique_ptr<Mapper> mapper_;
  MeshStore mesh_{1.0f};  ///< Only its blocks are used, not its voxel size.
  size_t fused_ = 0, bytes_ = 0, calls_since_mesh_ = 0;
};

/// The reason why a second map of `second_bytes` and the live map do not both fit into `max_bytes`;
/// empty if they do.
std::string whyTooLarge(size_t live_bytes, size_t second_bytes, size_t max_bytes);

}  // namespace dtsdf
