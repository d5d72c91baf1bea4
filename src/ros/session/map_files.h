/// Saves the map of a session to files, and loads it from them.
#pragma once

#include <optional>
#include <string>

#include "dtsdf_mapping/params/mapper_params.h"
#include "ros/common/worker_thread.h"
#include "ros/session/map_session.h"

namespace dtsdf {

/// One thread at a time. Compressing and writing, reading and checking are done on a thread of low
/// priority; the map's thread only copies the map, or takes over the new one. A map that is on disk
/// in part is too large to be copied: the map's thread saves it, piece by piece.
class MapFiles {
 public:
  /// What it works with; all of it outlives it.
  struct Parts {
    MapSession& session;
    WorkerThread& map_loop;
  };

  /// `params` are those that the session's mapper was made with.
  MapFiles(const MapperParams& params, std::string map_frame, const Parts& parts);

  /// What was saved or loaded.
  struct Done {
    uint64_t blocks = 0;
    std::string message;
  };

  /// @throws std::exception if the map cannot be copied, or the file not be written.
  Done save(const std::string& path);

  /// Replaces the map. An empty one takes the settings of the file, any other has to have them.
  /// @throws std::exception if the file cannot be read or does not fit; the map is as it was.
  Done load(const std::string& path);

  /// Ends the thread. Tasks that were not run fail.
  void stop() { file_loop_.stop(); }

 private:
  void checkFitsCurrent(const MapContents& contents) const;
  std::optional<SavedMap> saveInPieces(const std::string& path);
  SavedMap saveCopy(const std::string& path);

  MapperParams params_;  ///< Of the map as it is.
  const std::string map_frame_;
  Parts parts_;
  WorkerThread file_loop_;
};

}  // namespace dtsdf
