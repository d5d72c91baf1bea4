#include "ros/steps/files.h"

#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "params/text.h"
#include "ros/common/free_memory.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {

FilesStep::FilesStep(const Host& host) : host_(host), params_(host.params.mapper) {}

/// A service with a file, whose calls are served in turn. `work` gets request, answer and path.
template <class Service, class FileWork>
void FilesStep::addServer(const ros::NodeHandle& nh, const std::string& name,
                          const std::vector<std::string>& extensions, FileWork work) {
  servers_.push_back(
      serve<Service>(nh, name, [this, extensions, work](const auto& request, auto& response) {
        const uint64_t number = ++calls_;
        const std::lock_guard<std::mutex> lock(mutex_);
        turn_ = number;
        const std::string path =
            resolveOutputPath(host_.params.node.output_directory, request.file_name, extensions);
        work(request, response, path);
        response.path = path;
      }));
}

void FilesStep::advertise(const Handles& handles) {
  using namespace dtsdf_mapping;
  addServer<SaveMesh>(
      handles.waiting, "save_mesh", meshExtensions(),
      [this](const auto& request, auto& response, const std::string& path) {
        const Eigen::Isometry3d T_W_F = host_.frame.find(request.frame_id);
        SaveChoice choice;
        choice.region = readBox(request.region);
        if (choice.region) choice.region->T_W_B = T_W_F * choice.region->T_W_B;
        choice.simplify_error_m = request.simplify_error_m;
        if (!(choice.simplify_error_m >= 0.0) || std::isinf(choice.simplify_error_m)) {
          throw std::runtime_error("simplify_error_m must be a number of metres, or 0");
        }
        choice.go_on = [this, number = turn_](double) {
          return calls_ == number && !host_.is_ending;
        };
        const std::string note = flushMesh();
        const SavedMesh saved = writeMesh(path, choice);
        response.vertices = saved.vertices;
        response.triangles = saved.triangles;
        response.error_m = saved.error_m;
        response.message = "saved " + std::to_string(saved.triangles) + " triangles to " + path;
        if (choice.simplify_error_m != 0.0) {
          response.message += ", at most " + shortestText(saved.error_m) + " m from the whole mesh";
        }
        if (!saved.loss.empty()) response.message += "; " + saved.loss;
        response.message += note;
      });
  const auto ofMap = [this](Done (FilesStep::*work)(const std::string&)) {
    return [this, work](const auto&, auto& response, const std::string& path) {
      const Done done = (this->*work)(path);
      response.blocks = done.blocks;
      response.message = done.message;
    };
  };
  addServer<SaveMap>(handles.waiting, "save_map", {kMapExtension}, ofMap(&FilesStep::saveMap));
  addServer<LoadMap>(handles.waiting, "load_map", {kMapExtension}, ofMap(&FilesStep::loadMap));
}

/// Part by part, so that they need not be in memory at once; no frame comes between them, which
/// would bring more. @return in what the mesh is not that of the map; empty: in nothing.
std::string FilesStep::flushMesh() {
  const auto flush = [this] {
    LiveMap::MeshFlush flushed;
    do {
      flushed = host_.map.flushMesh();
      host_.take_changes();
    } while (flushed.is_part);
    return flushed.problem;
  };
  return host_.map_loop.run(flush).get();
}

/// A mesh in memory is copied, block by shared block, so that the output continues meanwhile.
SavedMesh FilesStep::writeMesh(const std::string& path, const SaveChoice& choice) {
  const MeshColour colour = host_.params.mapper.mesh.colour;
  std::unique_lock<std::mutex> lock(host_.mesh.mutex);
  if (!host_.params.mapper.map.page_folder.empty()) {
    return savePagedMesh(host_.mesh.meshes, colour, path, choice);
  }
  PagedMeshes copy(host_.params.mapper.map);
  copy.clear(host_.mesh.meshes.voxelSize());
  for (const auto& [key, block] : host_.mesh.meshes.all().blocks()) copy.put(block);
  lock.unlock();
  return savePagedMesh(copy, colour, path, choice);
}

FilesStep::Done FilesStep::saveMap(const std::string& path) {
  const std::string& map_frame = host_.params.node.map_frame;
  std::optional<MapContents> contents;
  SavedMap saved = host_.map_loop
                       .run([&] {
                         if (!host_.map.hasRoomFor(host_.map.mapper().stats().map_bytes)) {
                           return saveMapOf(host_.map.mapper(), host_.map.origin(map_frame), path);
                         }
                         contents = contentsWith(host_.map.origin(map_frame), host_.map.mapper());
                         return SavedMap();
                       })
                       .get();
  if (contents) saved = dtsdf::saveMap(*contents, path);
  return {saved.size.blocks,
          formatted("saved %zu blocks (%.1f MB) to ", static_cast<size_t>(saved.size.blocks),
                    static_cast<double>(saved.file_bytes) / 1e6) +
              path};
}

/// @throws std::runtime_error that says what to do.
void FilesStep::checkFitsCurrent(const MapContents& contents) const {
  checkFits(contents, params_, "call clear_map first: an empty map takes the settings of the file");
}

FilesStep::Done FilesStep::loadMap(const std::string& path) {
  const auto file = std::make_shared<const MapChunks>(path, params_);
  const MapContents& contents = file->head();
  checkFrame(contents, host_.params.node.map_frame);
  checkLevel(contents, host_.frame.isLevelled());
  const bool is_empty = host_.map_loop.run([this] { return host_.map.isEmpty(); }).get();
  if (!is_empty) checkFitsCurrent(contents);
  const auto has_room = [&] { return host_.map.hasRoomFor(file->size().bytes()); };
  if (!is_empty && !host_.map_loop.run(has_room).get()) {
    file->verify();  // before the map goes that it takes the place of
    host_.map_loop.run([this] { host_.map.clear(); }).get();
    returnFreeMemory();
  }
  const MapperParams params = is_empty ? withSettingsOf(contents, params_) : params_;
  std::unique_ptr<Mapper> mapper = makeMapper(params, partsOf(file));
  // The old mapper comes back, so that the map's thread need not wait until its memory is freed.
  mapper = host_.map_loop
               .run([&] {
                 // Frames may have come meanwhile, with the settings that the map had.
                 if (!host_.map.isEmpty()) checkFitsCurrent(contents);
                 return host_.map.replace(
                     {std::move(mapper), params.map.voxel_size_m, path, partsOf(file).head, file});
               })
               .get();
  mapper.reset();
  params_ = params;
  host_.restart_motion();
  host_.await_output();
  returnFreeMemory();  // that of the old map
  return {contents.blocks.size(),
          "loaded " + std::to_string(contents.blocks.size()) + " blocks from " + path};
}

}  // namespace dtsdf
