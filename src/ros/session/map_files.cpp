#include "ros/session/map_files.h"

#include <memory>
#include <utility>

#include "io/map_chunks.h"
#include "params/text.h"

namespace dtsdf {
namespace {

std::string inMegabytes(uint64_t bytes) {
  return formatted("%.1f MB", static_cast<double>(bytes) / 1e6);
}

}  // namespace

MapFiles::MapFiles(const MapperParams& params, std::string map_frame, const Parts& parts)
    : params_(params),
      map_frame_(std::move(map_frame)),
      parts_(parts),
      file_loop_([] { return std::chrono::hours(1); }, WorkerThread::Priority::kLow) {}

MapFiles::Done MapFiles::save(const std::string& path) {
  const std::optional<SavedMap> in_pieces =
      parts_.map_loop.run([&] { return saveInPieces(path); }).get();
  const SavedMap saved = in_pieces ? *in_pieces : saveCopy(path);
  return {saved.size.blocks, "saved " + std::to_string(saved.size.blocks) + " blocks (" +
                                 inMegabytes(saved.file_bytes) + ") to " + path};
}

/// @throws std::runtime_error that says what to do.
void MapFiles::checkFitsCurrent(const MapContents& contents) const {
  checkFits(contents, params_, "call clear_map first: an empty map takes the settings of the file");
}

/// Map's thread. @return nothing where the map is in memory, and is better copied.
std::optional<SavedMap> MapFiles::saveInPieces(const std::string& path) {
  if (!parts_.session.isPaged()) return std::nullopt;
  return parts_.session.save(path, map_frame_);
}

/// A map that has gone to disk in part meanwhile is copied all the same.
SavedMap MapFiles::saveCopy(const std::string& path) {
  MapContents contents = parts_.map_loop.run([this] { return parts_.session.contents(); }).get();
  contents.map_frame = map_frame_;
  return file_loop_.run([&] { return saveMap(contents, path); }).get();
}

MapFiles::Done MapFiles::load(const std::string& path) {
  const std::shared_ptr<const MapChunks> file =
      file_loop_.run([&] { return std::make_shared<const MapChunks>(path, params_); }).get();
  const MapContents& contents = file->head();
  checkFrame(contents, map_frame_);
  checkLevel(contents, parts_.session.isLevelled());
  const bool is_empty = parts_.map_loop.run([this] { return parts_.session.isEmpty(); }).get();
  if (!is_empty) checkFitsCurrent(contents);
  const MapperParams params = is_empty ? withSettingsOf(contents, params_) : params_;
  std::unique_ptr<Mapper> mapper =
      file_loop_.run([&] { return makeMapper(params, partsOf(file)); }).get();
  // The old mapper comes back, so that the map's thread need not wait until its memory is freed.
  mapper = parts_.map_loop
               .run([&] {
                 // Frames may have come meanwhile, with the settings that the map had.
                 if (!parts_.session.isEmpty()) checkFitsCurrent(contents);
                 return parts_.session.replace(
                     {std::move(mapper), params.map.voxel_size_m, path, partsOf(file).head,
                      [file](const std::string& to) { copyMapFile(*file, to); }});
               })
               .get();
  params_ = params;
  return {contents.blocks.size(),
          "loaded " + std::to_string(contents.blocks.size()) + " blocks from " + path};
}

}  // namespace dtsdf
