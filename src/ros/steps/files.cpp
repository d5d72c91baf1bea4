/// The step that reads and writes mesh and map files.
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>

#include <ros/console.h>

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/map_chunks.h"
#include "io/saved_mesh.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/common/free_memory.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/steps/live_map.h"
#include "ros/steps/make_steps.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {
namespace {

/// Serves save_mesh, save_map and load_map, one call at a time, on the service threads. The map
/// thread updates the mesh, copies the map or replaces it. If a copy does not fit into
/// map/max_memory_mb, or blocks are on disk, the map thread writes the file itself, part by part.
/// A new call cancels a running simplification of a mesh.
class FilesStep : public Step {
 public:
  explicit FilesStep(const Host& host) : host_(host) {}

  void advertise(const Handles& handles) override {
    using namespace dtsdf_mapping;
    addServer<SaveMesh>(
        handles.waiting, "save_mesh", meshExtensions(),
        [this](const auto& request, auto& response, const std::string& path) {
          const auto region = readBox(request.region, host_.frame.find(request.frame_id));
          const double simplify_error_m = request.simplify_error_m;
          if (!(simplify_error_m >= 0.0) || std::isinf(simplify_error_m)) {
            throw std::runtime_error("simplify_error_m must be 0 or a positive number of metres");
          }
          const auto check_turn = [this, number = turn_](double) {
            if (calls_ == number && !host_.is_ending) return;
            throw std::runtime_error("cancelled before the mesh was simplified");
          };
          const std::string note = flushMesh();
          const SavedMesh saved = writeMesh(path, region, simplify_error_m, check_turn);
          response.vertices = saved.vertices;
          response.triangles = saved.triangles;
          response.error_m = saved.error_m;
          response.message = "saved " + std::to_string(saved.triangles) + " triangles to " + path;
          if (simplify_error_m != 0.0) {
            response.message +=
                ", at most " + shortestText(saved.error_m) + " m from the unsimplified mesh";
          }
          if (!saved.loss.empty()) response.message += "; " + saved.loss;
          response.message += note;
        });
    addServer<SaveMap>(handles.waiting, "save_map", {kMapExtension},
                       [this](const auto&, auto& response, const std::string& path) {
                         const MapInfo saved = saveMap(path);
                         response.blocks = saved.size.blocks;
                         response.message = formatted("saved %zu blocks (%.1f MB) to ",
                                                      static_cast<size_t>(saved.size.blocks),
                                                      static_cast<double>(saved.file_bytes) / 1e6) +
                                            path;
                       });
    addServer<LoadMap>(handles.waiting, "load_map", {kMapExtension},
                       [this](const auto&, auto& response, const std::string& path) {
                         response.blocks = loadMap(path);
                         response.message =
                             "loaded " + std::to_string(response.blocks) + " blocks from " + path;
                       });
  }

  void begin() override {
    if (host_.params.load_file.empty()) return;
    const std::string path = resolveOutputPath(host_.params.output_directory,
                                               host_.params.load_file, {kMapExtension}, true);
    const size_t blocks = loadMap(path);
    ROS_INFO_STREAM_NAMED("dtsdf_mapping",
                          "loaded " << blocks << " blocks from " << printable(path));
  }

 private:
  /// Adds a service that reads or writes a file. Calls to all these services are served one at a
  /// time. `work` gets request, response and path.
  template <class Service, class FileWork>
  void addServer(const ros::NodeHandle& nh, const std::string& name,
                 const std::vector<std::string>& extensions, FileWork work) {
    servers_.push_back(
        serve<Service>(nh, name, [this, extensions, work](const auto& request, auto& response) {
          const uint64_t number = ++calls_;
          const std::lock_guard<std::mutex> lock(mutex_);
          turn_ = number;
          const std::string path =
              resolveOutputPath(host_.params.output_directory, request.file_name, extensions,
                                std::is_same<Service, dtsdf_mapping::LoadMap>::value);
          work(request, response, path);
          response.path = path;
        }));
  }

  /// Brings the mesh up to date, part by part to save memory. No frame is fused in between.
  /// @return a note on how the mesh differs from the map; empty if it does not.
  std::string flushMesh() {
    const auto flush = [this] {
      std::string problem;
      do {
        problem = host_.map.flushMesh();
        host_.take_changes();
      } while (problem.empty() && host_.map.isMeshPart());
      return problem;
    };
    return host_.map_loop.run(flush).get();
  }

  /// Writes a copy of the mesh, so that the output can continue; the copy shares the mesh's blocks.
  /// With map/page_folder, nothing is copied, and no mesh is published until the file is written.
  SavedMesh writeMesh(const std::string& path, const std::optional<BoxRegion>& region,
                      double simplify_error_m, const SimplifyProgress& progress) {
    const MeshColour colour = host_.params.mapper.mesh.colour;
    std::unique_lock<std::mutex> lock(host_.mesh.mutex);
    if (!host_.params.mapper.map.page_folder.empty()) {
      return savePagedMesh(host_.mesh.meshes, colour, path, region, simplify_error_m, progress);
    }
    PagedMeshes copy(host_.params.mapper.map);
    copy.clear(host_.mesh.meshes.voxelSize());
    const MeshStore all = host_.mesh.meshes.all();
    for (const auto& [key, block] : all.blocks()) copy.put(block);
    lock.unlock();
    return savePagedMesh(copy, colour, path, region, simplify_error_m, progress);
  }

  /// @throws std::exception if the map cannot be copied or the file cannot be written.
  MapInfo saveMap(const std::string& path) {
    std::optional<MapContents> contents;
    const auto copy_or_save = [&] {
      const MapOrigin origin = host_.map.origin(host_.params.map_frame);
      Mapper& mapper = host_.map.mapper();
      if (!host_.map.hasRoomFor(mapper.stats().map_bytes)) return saveMapOf(mapper, origin, path);
      contents = contentsWith(origin, mapper);
      return MapInfo();
    };
    const MapInfo saved = host_.map_loop.run(copy_or_save).get();
    return contents ? dtsdf::saveMap(*contents, path) : saved;
  }

  /// Replaces the map with the one in a file. An empty map adopts the file's settings; otherwise,
  /// the settings must match.
  /// @return the number of blocks. @throws std::exception if the file cannot be read or does not
  /// fit. The map then stays as it was, or is empty if there was no room for both maps.
  size_t loadMap(const std::string& path) {
    const MapperParams& current = host_.map.settings();
    const auto file = std::make_shared<const MapChunks>(path, current);
    const MapContents& contents = file->head();
    checkFrame(contents, host_.params.map_frame);
    checkLevel(contents, host_.frame.isLevelled());
    const bool is_empty = host_.map_loop.run([this] { return host_.map.isEmpty(); }).get();
    if (!is_empty) checkFitsCurrent(contents);
    const auto has_room = [&] { return host_.map.hasRoomFor(file->size().bytes()); };
    if (!is_empty && !host_.map_loop.run(has_room).get()) {
      // Makes sure that the whole file can be read before the map is cleared.
      file->visit([](const MapContents&) {});
      host_.map_loop.run([this] { host_.map.clear(); }).get();
      returnFreeMemory();
    }
    const MapperParams params = is_empty ? withSettingsOf(contents, current) : current;
    std::unique_ptr<Mapper> mapper = makeMapper(params, partsOf(file));
    const auto replace = [&] {
      // Frames may have been fused in the meantime, with the old settings.
      if (!host_.map.isEmpty()) checkFitsCurrent(contents);
      return host_.map.replace(std::move(mapper), params, path, contents, file);
    };
    // Frees the old mapper here, so that the map thread need not wait for it.
    host_.map_loop.run(replace).get().reset();
    host_.await_output();
    returnFreeMemory();  // the old map's memory
    return contents.blocks.size();
  }

  /// @throws std::runtime_error if the file's settings differ.
  void checkFitsCurrent(const MapContents& contents) const {
    checkFits(contents, host_.map.settings(),
              "call clear_map first: an empty map adopts the settings of the file");
  }

  const Host& host_;
  std::mutex mutex_;                ///< Held while a file is written or read.
  uint64_t turn_ = 0;               ///< Number of the call that holds the mutex.
  std::atomic<uint64_t> calls_{0};  ///< Number of the newest call; it waits if larger than turn_.
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace

std::unique_ptr<Step> makeFilesStep(const Host& host) { return std::make_unique<FilesStep>(host); }

}  // namespace dtsdf
