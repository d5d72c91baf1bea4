#include "tiles/run_report.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "io/atomic_file.h"
#include "io/file_hash.h"
#include "tiles/tile_folder.h"

namespace dtsdf {
namespace {

using Json = nlohmann::json;

Json toJson(const TileRecord& record) {
  return {{"frames", record.frames},           {"seconds", record.seconds},
          {"blocks", record.blocks},           {"triangles", record.triangles},
          {"map_bytes", record.map_bytes},     {"peak_bytes", record.peak_bytes},
          {"backend", record.backend},         {"map_file_bytes", record.map_file_bytes},
          {"processor_s", record.processor_s}, {"mesh_file_bytes", record.mesh_file_bytes}};
}

}  // namespace

void saveReport(const RunReport& report, const std::string& folder, const LoadedPlan& loaded,
                const TileQueue& queue) {
  Json json = {{"plan", loaded.id},
               {"processes", report.processes},
               {"plan_s", loaded.plan.seconds},
               {"fuse_s", report.fuse_s},
               {"plan_processor_s", loaded.plan.processor_s},
               {"tiles", Json::array()},
               {"failed", queue.failed()}};
  if (!report.failure.empty()) json["failure"] = report.failure;
  for (size_t i = 0; i < loaded.plan.tiles.size(); ++i) {
    Json tile = {{"tile", i}, {"attempts", queue.attempts(i)}};
    const auto maker = report.maker.find(i);
    if (maker != report.maker.end()) tile["process"] = maker->second;
    if (missingOfTile(folder, i, loaded.id).empty()) tile.update(toJson(loadRecord(folder, i)));
    json["tiles"].push_back(tile);
  }
  json["merge"] = {{"seconds", report.merged.seconds},
                   {"processor_s", report.merged.processor_s},
                   {"blocks", report.merged.blocks},
                   {"vertices", report.merged.vertices},
                   {"triangles", report.merged.triangles},
                   {"content_hash", hashDigits(report.merged.content_hash)}};
  writeFileAtomically((std::filesystem::path(folder) / "report.json").string(),
                      json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace dtsdf
