// map_tool boxes and join: for building one map in several processes.
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "io/atomic_file.h"
#include "io/map_chunks.h"
#include "map/map_head.h"
#include "mapper/probed_mapper.h"
#include "params/printable.h"
#include "program/run_program.h"
#include "tools/boxes.h"
#include "tools/map_settings.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

/// Joins boxes in one mapper, which keeps a large map partly on disk.
class BoxJoiner {
 public:
  void add(const std::string& path) {
    files_.push_back(std::make_unique<MapChunks>(path));
    const MapContents& head = files_.back()->head();
    const std::optional<MapBox>& box = files_.back()->box();
    if (!box) {
      throw std::runtime_error("'" + printable(path) +
                               "' is not the map of a box; build it with reconstruct --only");
    }
    boxes_.push_back({box->first, box->last});
    if (files_.size() == 1) head_ = headOf(head);
    checkSame(head, path);
    fused_.insert(fused_.end(), box->fused.begin(), box->fused.end());
    supporting_.insert(supporting_.end(), box->supporting.begin(), box->supporting.end());
    head_.stamp_s = std::max(head_.stamp_s, head.stamp_s);
    if (head.painted) head_.exposure = head.exposure;
    head_.painted |= head.painted;
    for (const MapBlock& block : head.blocks) {
      if (!boxes_.back().contains(block.key)) {
        throw std::runtime_error("'" + printable(path) + "' contains blocks outside its box");
      }
      head_.blocks.push_back(block);
    }
    head_.free_cubes.insert(head_.free_cubes.end(), head.free_cubes.begin(), head.free_cubes.end());
  }

  /// @throws std::runtime_error that lists the missing boxes.
  void checkComplete() const {
    constexpr size_t kMaxNamed = 10;
    const std::vector<BlockExtent> missing = missingBoxes(boxes_);
    if (missing.empty()) return;
    const MapperParams params = withSettingsOf(head_, {});
    const double block_m = static_cast<double>(params.map.voxel_size_m) * kBlockSide;
    std::string list;
    for (size_t i = 0; i < std::min(missing.size(), kMaxNamed); ++i) {
      list += (i == 0 ? "" : " ") + boxText(missing[i], block_m);
    }
    throw std::runtime_error("boxes are missing: " + list +
                             (missing.size() > kMaxNamed ? " ..." : "") +
                             "; build them with reconstruct --only");
  }

  /// If the map is large, uses a temporary file in the folder of `path`.
  MapInfo save(const std::string& path) {
    const auto sort = [](auto& values) {
      std::sort(values.begin(), values.end(),
                [](const auto& a, const auto& b) { return packKey(a.key) < packKey(b.key); });
    };
    sort(head_.blocks);
    sort(head_.free_cubes);
    head_.frames = countOfUnion(std::move(fused_));
    head_.supporting_frames = countOfUnion(std::move(supporting_));
    std::vector<std::string> given{"backend=cpu"};
    if (head_.cell_voxels != 0) given.emplace_back("space/enabled=true");
    RunSettings settings = settingsFor(head_, given);
    MapParams& map = settings.params.mapper.map;
    if (const MapParams by_default; map.max_memory_mb > by_default.max_memory_mb) {
      map.max_memory_mb = by_default.max_memory_mb;
      map.page_folder = std::filesystem::absolute(path).parent_path().string();
      map.page_max_gb = 1000.0f;
    }
    const MapParts parts{{std::shared_ptr<void>(), &head_}, [this](const auto& take) {
                           for (const auto& file : files_) file->visit(take);
                         }};
    const auto mapper = makeProbedMapper(settings.params.mapper, settings.rules, parts);
    MapInfo saved = saveMapOf(*mapper, head_, path);
    if (const PageStats pages = mapper->stats().pages; pages.lost > 0) {
      throw std::runtime_error(std::to_string(pages.lost) +
                               " blocks were lost and are missing from the saved map: " +
                               pages.problem + "; join the boxes again");
    }
    return saved;
  }

 private:
  void checkSame(const MapContents& head, const std::string& path) const {
    if (head.settings == head_.settings && head.map_frame == head_.map_frame &&
        head.cell_voxels == head_.cell_voxels && haveSameLevel(head, head_) &&
        (!head.painted || !head_.painted || head.exposure == head_.exposure)) {
      return;
    }
    throw std::runtime_error("'" + printable(path) +
                             "' differs from the boxes before it in settings, frame or exposure; "
                             "build all boxes with the same options");
  }

  std::vector<std::unique_ptr<MapChunks>> files_;
  std::vector<BlockExtent> boxes_;
  IndexRanges fused_, supporting_;
  MapContents head_;
};

/// Raises the limit on open files, since the files of all boxes are open at once.
void allowManyFiles() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace

void printBoxes(const std::vector<std::string>& arguments) {
  RunOptions input;
  size_t count = 0;
  double edge_m = 0.0;
  CommandLine line(
      "map_tool boxes", "RECORDING --count N | --box-m METRES [options]",
      "Divides space into boxes that contain about equal parts of a recording's surfaces, and "
      "prints them, one per line, for reconstruct --only. Only a sample of the images is "
      "read, but the boxes cover all of space.");
  line.addText({"RECORDING", "", "a recording, as for reconstruct"}, input.recording.path);
  line.addNumber({"--count", "N", "number of boxes"}, count, {1, 1e6});
  line.addNumber({"--box-m", "METRES", "maximum extent of the surfaces in a box"}, edge_m,
                 {0.01, 1e6});
  line.requireOneOf({"--count", "--box-m"});
  line.beginGroup("Input");
  addFormatOption(line, input);
  addReadingOptions(line, input);
  addFrameOptions(line, input);
  line.beginGroup("Settings");
  addMapperOptions(line, input);
  line.parse(arguments);
  completeInput(input);
  const RunSettings settings = readSettings(input);
  const double block_m = static_cast<double>(settings.params.mapper.map.voxel_size_m) * kBlockSide;
  for (const BlockExtent& box : planBoxes(input, settings, count, edge_m)) {
    std::printf("%s\n", boxText(box, block_m).c_str());
  }
}

void joinBoxes(const std::vector<std::string>& arguments) {
  std::vector<std::string> paths;
  std::string map_path;
  CommandLine line(
      "map_tool join", "BOX.dtsdf ... --save-map OUT.dtsdf",
      "Joins the maps of boxes, saved by reconstruct --only, into the map that one process "
      "would build. The boxes must cover all of space; an error lists any missing "
      "boxes.");
  line.addList({"BOXES", "", "maps of boxes"},
               [&](const std::string& path) { paths.push_back(path); });
  addSaveMapOption(line, "the joined map to write", map_path);
  line.require("--save-map");
  line.parse(arguments);
  prepareOutputFile(map_path);
  allowManyFiles();
  BoxJoiner joiner;
  for (const std::string& path : paths) joiner.add(path);
  joiner.checkComplete();
  const MapInfo saved = joiner.save(map_path);
  std::printf("%zu blocks from %zu boxes, %.1f MB, content hash %016llx: %s\n", saved.size.blocks,
              paths.size(), static_cast<double>(saved.file_bytes) / 1e6,
              static_cast<unsigned long long>(saved.content_hash), map_path.c_str());
}

}  // namespace dtsdf
