#include "tiles/tile_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>

#include "io/atomic_file.h"
#include "io/file_hash.h"
#include "io/text_file.h"
#include "params/text.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Calls visit(key, value) for what a record's file has as it is: all but the checksums.
template <class Record, class Visit>
void visitFields(Record& record, const Visit& visit) {
  visit("plan", record.plan_id);
  visit("mesh_first_block", record.mesh_bounds.first);
  visit("mesh_last_block", record.mesh_bounds.last);
  visit("map_file_bytes", record.map_file_bytes);
  visit("mesh_file_bytes", record.mesh_file_bytes);
  visit("blocks", record.blocks);
  visit("voxel_arrays", record.voxel_arrays);
  visit("free_cubes", record.free_cubes);
  visit("triangles", record.triangles);
  visit("frames", record.frames);
  visit("images", record.images);
  visit("map_bytes", record.map_bytes);
  visit("peak_bytes", record.peak_bytes);
  visit("seconds", record.seconds);
  visit("processor_s", record.processor_s);
  visit("backend", record.backend);
}

uint64_t hashOfDigits(const std::string& digits) {
  if (digits.size() != 16 || digits.find_first_not_of("0123456789abcdef") != digits.npos) {
    throw std::runtime_error("a checksum is not a number");
  }
  return std::stoull(digits, nullptr, 16);
}

bool hasBytes(const std::string& path, uint64_t bytes) {
  std::error_code error;
  const uintmax_t size = fs::file_size(path, error);
  return !error && size == bytes;
}

/// Takes the lock of an open file. @return what is in the way: 0 for nothing, EWOULDBLOCK for
/// another process, else why its file system cannot lock it.
int takeLock(int descriptor) { return flock(descriptor, LOCK_EX | LOCK_NB) == 0 ? 0 : errno; }

/// Whether somebody works on a tile.
bool isLocked(const std::string& folder, size_t tile) {
  const int descriptor = open(tilePath(folder, tile, ".lock").c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool locked = takeLock(descriptor) == EWOULDBLOCK;
  close(descriptor);
  return locked;
}

}  // namespace

std::string planPath(const std::string& folder) {
  return (fs::path(folder) / "plan.json").string();
}

std::string tilePath(const std::string& folder, size_t tile, const std::string& ending) {
  return (fs::path(folder) / "tiles" / (formatted("%04zu", tile) + ending)).string();
}

void prepareTiles(const std::string& folder) { prepareOutputFile(tilePath(folder, 0, ".lock")); }

void saveRecord(const TileRecord& record, const std::string& folder, size_t tile) {
  Json json = {{"content_hash", hashDigits(record.content_hash)},
               {"mesh_checksum", hashDigits(record.mesh_checksum)}};
  visitFields(record, [&](const char* key, const auto& value) { json[key] = value; });
  writeFileAtomically(tilePath(folder, tile, ".json"), json.dump(1) + "\n");
}

TileRecord loadRecord(const std::string& folder, size_t tile) {
  const std::string path = tilePath(folder, tile, ".json");
  const std::string text = readTextFile(path, "make it with tiles fuse");
  try {
    const Json json = Json::parse(text);
    TileRecord record;
    record.content_hash = hashOfDigits(json.at("content_hash"));
    record.mesh_checksum = hashOfDigits(json.at("mesh_checksum"));
    visitFields(record, [&](const char* key, auto& value) { json.at(key).get_to(value); });
    return record;
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + path + "' is not the record of a tile (" + error.what() + ")");
  }
}

std::string missingOfTile(const std::string& folder, size_t tile, const std::string& plan_id) {
  TileRecord record;
  try {
    record = loadRecord(folder, tile);
  } catch (const std::exception& error) {
    return error.what();
  }
  if (record.plan_id != plan_id) return "it belongs to another plan";
  if (!hasBytes(tilePath(folder, tile, ".dtsdf"), record.map_file_bytes)) {
    return "its map file is missing or has the wrong size";
  }
  if (!hasBytes(tilePath(folder, tile, ".mesh"), record.mesh_file_bytes)) {
    return "its meshes are missing or have the wrong size";
  }
  return "";
}

TileState stateOf(const std::string& folder, size_t tile, const std::string& plan_id) {
  if (isLocked(folder, tile)) return {TileStage::kRunning, "another process is making it"};
  if (fs::exists(tilePath(folder, tile, ".json"))) {
    const std::string missing = missingOfTile(folder, tile, plan_id);
    if (missing.empty()) return {TileStage::kDone, ""};
    return {TileStage::kWaiting, missing};
  }
  const std::string failed = tilePath(folder, tile, ".failed");
  if (!fs::exists(failed)) return {TileStage::kWaiting, ""};
  return {TileStage::kFailed, readTextFile(failed, "make it with tiles fuse")};
}

void forgetTile(const std::string& folder, size_t tile) {
  // The record first: without it, the others are nothing.
  for (const char* ending : {".json", ".failed", ".dtsdf", ".mesh"}) {
    fs::remove(tilePath(folder, tile, ending));
  }
}

TileLock::TileLock(const std::string& folder, size_t tile) {
  prepareTiles(folder);
  const std::string path = tilePath(folder, tile, ".lock");
  descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) {
    throw std::runtime_error("cannot write '" + path +
                             "': " + std::generic_category().message(errno));
  }
  const int problem = takeLock(descriptor_);
  if (problem == 0) return;
  close(descriptor_);
  if (problem != EWOULDBLOCK) {
    throw std::runtime_error("cannot lock '" + path +
                             "': " + std::generic_category().message(problem) +
                             "; put the folder of the plan on a file system with locks (Lustre: "
                             "mount it with -o flock)");
  }
  throw std::runtime_error("tile " + std::to_string(tile) + " is being made by another process; " +
                           "wait for it or end it");
}

TileLock::~TileLock() { close(descriptor_); }

}  // namespace dtsdf
