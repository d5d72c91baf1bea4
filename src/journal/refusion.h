/// Fuses the images of a journal once more, at corrected poses, beside the map as it is.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "journal/replay.h"

namespace dtsdf {

/// In turns: each step() does a little, so that images that come meanwhile go first.
struct Refusion {
  /// Opens the journal and makes the map to begin with, if the correction moves an image.
  /// @param run Where and on how many threads; all other settings are the journal's.
  /// @throws std::runtime_error if the journal cannot be read, or refuses the correction.
  Refusion(const std::string& path, const MapperParams& run, journal::Correction by);

  /// Does the next record of the journal, or reads what was added to it.
  /// @param live_bytes Those of the map as it is: both together stay within map/max_memory_mb.
  /// @return whether it did something; if not, it has caught up with the journal as it is written.
  /// @throws std::runtime_error if there is too little memory, or the journal is damaged.
  bool step(size_t live_bytes);

  JournalReplay replay;
  const journal::Correction correction;
  CorrectionEffect effect;
  std::unique_ptr<Mapper> mapper;
  size_t fused = 0;  ///< Depth images fused.
  size_t bytes = 0;  ///< Size of the map, when last measured.
};

/// Why a second map of so many bytes does not fit into the budget beside the live one; empty if it
/// does.
std::string whyTooLarge(size_t live_bytes, size_t second_bytes, size_t max_bytes);

}  // namespace dtsdf
