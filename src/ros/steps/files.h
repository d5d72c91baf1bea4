/// The step that writes and reads files: meshes and maps.
#pragma once

#include <ros/node_handle.h>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "io/map_chunks.h"
#include "io/saved_mesh.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// save_mesh, save_map and load_map, one after the other, on the threads of services: the map's
/// thread only copies the map, or takes over the new one. A map that is on disk in part is too
/// large to be copied: the map's thread saves it, piece by piece. A mesh that is being simplified
/// gives up for the next call.
class FilesStep : public Step {
 public:
  explicit FilesStep(const Host& host);

  void advertise(const Handles& handles) override;

  /// What was saved or loaded.
  struct Done {
    uint64_t blocks = 0;
    std::string message;
  };
  /// @throws std::exception if the map cannot be copied, or the file not be written.
  Done saveMap(const std::string& path);
  /// Replaces the map. An empty one takes the settings of the file, any other has to have them.
  /// @throws std::exception if the file cannot be read or does not fit; the map is as it was.
  Done loadMap(const std::string& path);

 private:
  template <class Service, class FileWork>
  void addServer(const ros::NodeHandle& nh, const std::string& name,
                 const std::vector<std::string>& extensions, FileWork work);
  std::string flushMesh();
  SavedMesh writeMesh(const std::string& path, const SaveChoice& choice);
  void checkFitsCurrent(const MapContents& contents) const;

  const Host& host_;
  MapperParams params_;             ///< Of the map as it is.
  std::mutex mutex_;                ///< Held while a file is written or read,
  uint64_t turn_ = 0;               ///< by the call with this number,
  std::atomic<uint64_t> calls_{0};  ///< which sees by the newest one that another waits.
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace dtsdf
