/// reconstruct: builds a map and a mesh from the frames of a recording, reproducibly.
#include <array>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "dtsdf_mapping/io/map_file.h"
#include "io/atomic_file.h"
#include "io/map_chunks.h"
#include "io/trajectory.h"
#include "io/wrapped_images.h"
#include "journal/replay.h"
#include "mapper/probed_mapper.h"
#include "params/param_copy.h"
#include "params/printable.h"
#include "program/progress_bar.h"
#include "program/run_program.h"
#include "tools/boxes.h"
#include "tools/map_settings.h"
#include "tools/reconstruct_options.h"
#include "tools/reconstruction.h"
#include "tools/reconstruction_report.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

/// The settings of a run that resumes from a map, which determines some of them. @throws
/// std::runtime_error if explicitly given settings conflict with the map, or if the map is in a
/// different frame.
MapperParams settingsWith(const MapContents& loaded, const RunSettings& settings) {
  MapperParams params = withSettingsOf(loaded, settings.params.mapper);
  ParamTree tree = toTree(params);
  for (auto& [key, value] : tree) {
    const auto given = settings.given.find(key);
    if (given != settings.given.end()) value = given->second;
  }
  checkFits(loaded, readMapperParams(tree), kLeaveSettingOut);
  if (settings.given.count("map/level")) checkLevel(loaded, isLevelled(settings.params));
  checkFrame(loaded, settings.given.count("map_frame") ? settings.params.map_frame : std::string());
  return params;
}

/// The origin of a run's map. A loaded map keeps the name of its frame and, if frames were fused
/// into it, its levelling transform.
/// @param loaded Null if the run begins with an empty map.
MapOrigin originOf(const ReconstructOptions& options, const RunSettings& settings,
                   const MapContents* loaded) {
  const bool is_named = loaded != nullptr && !loaded->map_frame.empty();
  const bool continues = loaded != nullptr && loaded->frames > 0;
  return {is_named ? loaded->map_frame : nameOfFrame(options, settings),
          continues ? loaded->T_W_M : findLevel(options, settings), 0.0, settings.params.poses};
}

/// Saves the map of a run and prints its size.
void saveAndPrint(Mapper& mapper, const MapOrigin& origin, const MapBox* box,
                  const std::string& path) {
  const MapInfo saved =
      box != nullptr ? saveBoxOf(mapper, origin, *box, path) : saveMapOf(mapper, origin, path);
  std::printf("%zu blocks, %.1f MB: %s\n", saved.size.blocks,
              static_cast<double>(saved.file_bytes) / 1e6, path.c_str());
}

void printSummary(const ReconstructionResult& result, const std::string& backend_name,
                  const std::string& mesh_path) {
  const std::string skipped = describeSkipped(result.skipped, result.problems);
  std::printf("%zu frames fused on %s in %.1f ms each (median)%s%s\n", result.frames,
              backend_name.c_str(), summarise(result.integrate_ms).median,
              skipped.empty() ? "" : "; not fused: ", skipped.c_str());
  if (!result.aligned.empty()) {
    std::printf("poses found in %.1f ms each (median): %s\n", summarise(result.align_ms).median,
                describeSkipped(result.aligned).c_str());
  }
  if (!result.shift_mm.empty()) {
    std::printf(
        "poses moved by %.1f mm and %.2f degrees (medians): %.1f %% of the points lie on surfaces, "
        "%.1f %% before each image was aligned\n",
        summarise(result.shift_mm).median, summarise(result.turn_degrees).median,
        100.0 * result.on_surfaces, 100.0 * result.on_surfaces_before);
  }
  if (result.images > 0) {
    std::printf("%zu colour images painted in %.1f ms each (median)\n", result.images,
                summarise(result.paint_ms).median);
  }
  if (!mesh_path.empty()) {
    std::printf("%zu vertices, %zu triangles: %s\n", result.vertices, result.triangles,
                mesh_path.c_str());
  }
  if (!result.doubt.empty()) {
    std::fprintf(stderr, "reconstruct: warning: %s\n", result.doubt.c_str());
  }
  const PageStats& pages = result.map.pages;
  if (pages.blocks > 0) {
    std::printf(
        "%zu blocks in memory, %zu (%.1f MB) in map/page_folder; %llu written, %llu read, "
        "%.1f s spent waiting for the disk\n",
        result.map.blocks, pages.blocks, static_cast<double>(pages.bytes) / 1e6,
        static_cast<unsigned long long>(pages.written), static_cast<unsigned long long>(pages.read),
        pages.wait_ms / 1e3);
  }
  if (pages.failures > 0) {
    std::fprintf(stderr,
                 "reconstruct: warning: %llu reads or writes in map/page_folder failed: %s\n",
                 static_cast<unsigned long long>(pages.failures), pages.problem.c_str());
  }
  if (result.map.refused_blocks > 0) {
    std::fprintf(stderr,
                 "reconstruct: warning: the map is full (%llu blocks refused), so parts are "
                 "missing; raise map/max_memory_mb or map/voxel_size_m\n",
                 static_cast<unsigned long long>(result.map.refused_blocks));
  }
}

/// Rejects a mesh that is empty because no surface was observed in mesh/min_support frames.
/// @throws std::runtime_error
void checkSupport(const ReconstructionResult& result, const MapperParams& params) {
  const int min_support = params.mesh.min_support;
  const bool has_mesh = result.meshes->triangleCount() > 0;
  if (has_mesh || result.map.voxel_arrays == 0 || min_support < 2) return;
  throw std::runtime_error(
      "the mesh is empty: no surface was observed in at least " + std::to_string(min_support) +
      " frames (mesh/min_support); --set mesh/min_support=1 accepts a single frame");
}

/// Checks in advance that the output files can be written.
void checkOutputs(const ReconstructOptions& options) {
  for (const std::string& path :
       {options.mesh_path, options.save_map_path, options.trajectory_path, options.report_path}) {
    if (!path.empty()) prepareOutputFile(path);
  }
}

void saveMeshOf(ReconstructionResult& result, MeshColour colour,
                const ReconstructOptions& options) {
  const SavedMesh saved =
      saveSimplified(*result.meshes, colour, options.mesh_path, options.simplify_error_m);
  result.vertices = saved.vertices;
  result.triangles = saved.triangles;
  if (!saved.loss.empty()) {
    std::fprintf(stderr, "reconstruct: warning: %s\n", saved.loss.c_str());
  }
}

/// Counts the vertices and triangles of a mesh that is not saved, for the report.
void countMesh(ReconstructionResult& result) {
  result.meshes->stream({[&](const Mesh& piece) { result.vertices += piece.vertices_m.size(); },
                         [&](const std::array<uint32_t, 3>&) { ++result.triangles; }});
}

/// Checks that nothing was lost. @throws std::runtime_error if pages on disk could not be read.
void checkLosses(const ReconstructionResult& result, const Mapper& mapper) {
  const PageStats pages = mapper.stats().pages;
  const bool lacks_meshes = result.meshes != nullptr && result.meshes->missed() > 0;
  if (pages.lost == 0 && !lacks_meshes) return;
  throw std::runtime_error(std::to_string(pages.lost) + " blocks of the map were lost" +
                           (lacks_meshes ? ", and parts of the mesh cannot be read" : "") + ": " +
                           (pages.lost > 0 ? pages.problem : result.meshes->stats().problem) +
                           "; they are missing from the saved files");
}

/// Checks that at least half of the images are usable, unless gaps are allowed.
/// @throws std::runtime_error
void requireMost(size_t usable, size_t images, const ReconstructOptions& options,
                 const std::string& what) {
  if (options.allow_gaps || 2 * usable >= images) return;
  throw std::runtime_error("only " + std::to_string(usable) + " of " + std::to_string(images) +
                           " images " + what + "; use --allow-gaps to accept this");
}

size_t depthImages(const ReconstructionResult& result) {
  size_t sum = result.frames;
  for (const auto& [reason, count] : result.skipped) {
    if (reason.rfind("colour images: ", 0) != 0) sum += count;
  }
  return sum;
}

/// Saves and prints the results of a run.
void saveAll(ReconstructionResult& result, Mapper& mapper, MapOrigin origin,
             const MapperParams& params, const ReconstructOptions& options,
             const MapBox* box = nullptr) {
  origin.stamp_s = result.stamp_s;
  // If the map cannot be saved, the other files are saved anyway.
  std::exception_ptr failure;
  try {
    if (!options.save_map_path.empty()) saveAndPrint(mapper, origin, box, options.save_map_path);
  } catch (const std::exception&) {
    failure = std::current_exception();
  }
  if (!options.trajectory_path.empty()) {
    saveTrajectory(result.trajectory, options.trajectory_path);
    std::printf("%zu poses: %s\n", result.trajectory.size(), options.trajectory_path.c_str());
  }
  if (!options.mesh_path.empty()) {
    checkSupport(result, params);
    saveMeshOf(result, params.mesh.colour, options);
  } else if (!options.report_path.empty()) {
    countMesh(result);
  }
  const std::string backend_name = mapper.backendName();
  if (!options.report_path.empty()) {
    writeFileAtomically(options.report_path, reportJson(result, backend_name));
  }
  printSummary(result, backend_name, options.mesh_path);
  if (failure != nullptr) std::rethrow_exception(failure);
  checkLosses(result, mapper);
}

/// Rejects options that do not apply to a journal, the node's record of its input.
/// @throws UsageError
void checkJournalOptions(const ReconstructOptions& options) {
  if (!options.load_map_path.empty() || !options.only.empty()) {
    throw UsageError("--load-map and --only are for recordings; a journal contains its own map");
  }
  const ParamTree of_mapper = toTree(MapperParams()), of_all = toTree(NodeParams());
  for (const std::string& setting : options.settings) {
    const std::string key = setting.substr(0, setting.find('='));
    if (of_all.count(key) == 0 || of_mapper.count(key) > 0) continue;
    throw UsageError(key +
                     " is for recordings; a journal contains images and poses as they were fused");
  }
}

/// Corrects the poses of a journal with those of --poses, which are given in --poses-frame.
/// @throws UsageError for an unknown frame.
void correct(JournalReplay& journal, const ReconstructOptions& options) {
  const std::string& path = options.recording.poses_path;
  const journal::Begin& begin = journal.begin();
  const std::string& frame = options.poses_frame;
  const bool is_level = !frame.empty() && frame == begin.level_frame;
  if (!frame.empty() && !is_level && frame != begin.map_frame) {
    throw UsageError("--poses-frame '" + printable(frame) + "': the journal's frames are '" +
                     printable(begin.map_frame) + "' and '" + printable(begin.level_frame) + "'");
  }
  std::vector<StampedPose> poses = readTrajectory(path, "expected a file with poses").poses();
  const CorrectionEffect effect = is_level ? journal.correct({journal.count(), std::move(poses)})
                                           : journal.correctGiven(std::move(poses));
  std::printf("journal: corrected %zu of %zu depth images with the poses in %s\n", effect.moved,
              journal.depthImages(), path.c_str());
}

/// Rebuilds the map from a journal.
void runJournal(const ReconstructOptions& options) {
  checkJournalOptions(options);
  checkOutputs(options);
  JournalReplay journal(options.recording.path);
  if (!journal.incompleteEnd().empty()) {
    std::fprintf(stderr, "reconstruct: warning: %s\n", journal.incompleteEnd().c_str());
  }
  if (!options.recording.poses_path.empty()) correct(journal, options);
  const journal::Begin& begin = journal.begin();
  const RunSettings settings = readSettings(options, copyOf(begin.settings));
  const MapperParams& params = settings.params.mapper;
  const auto mapper = journal.map() == nullptr
                          ? makeProbedMapper(params, settings.rules)
                          : makeProbedMapper(params, settings.rules, partsOf(journal.map()));
  ProgressBar progress("frames", journal.depthImages());
  ReconstructionResult result = reconstruct(journal, *mapper, params.map, options.mesh_every,
                                            [&](size_t done) { progress.show(done); });
  saveAll(result, *mapper, {begin.map_frame, journal.level(), 0.0, begin.poses}, params, options);
}

/// By default, the poses of a recording are refined. Poses from --poses are used unchanged. So are
/// the poses for a box, because refining them would require the whole map.
ParamTree defaultsFor(const ReconstructOptions& options) {
  if (!options.recording.poses_path.empty() || !options.only.empty()) return {};
  return {{"poses/mode", std::string("refine")}};
}

/// Limits the selected images to those that the box requires.
/// @param loaded Null if the run begins with an empty map.
/// @return nullopt if the run builds the whole map.
std::optional<BoxRun> prepareBox(ReconstructOptions& options, const RunSettings& settings,
                                 const MapChunks* loaded, const MapParams& map,
                                 const MapOrigin& origin) {
  const std::optional<MapBox> before = loaded != nullptr ? loaded->box() : std::nullopt;
  if (options.only.empty() && before) {
    throw std::runtime_error(
        "the map of --load-map is a box of a larger map; give the same --only, "
        "or load a map from map_tool join");
  }
  if (options.only.empty()) return std::nullopt;
  const BlockExtent box =
      parseBox(options.only, static_cast<double>(map.voxel_size_m) * kBlockSide);
  BoxRun run = planBoxRun(options, settings, origin.T_W_M, box);
  if (loaded != nullptr) {
    if (!before || packKey(before->first) != packKey(box.first) ||
        packKey(before->last) != packKey(box.last)) {
      throw std::runtime_error("--load-map must be a map of the same box as --only");
    }
    if (!run.images->empty()) {
      throw std::runtime_error(
          "a box with colour cannot be resumed, because its map lacks the surrounding blocks, "
          "which may occlude its surfaces; set colour/enabled=never");
    }
    run.box = *before;
    ++run.box.recordings;
  }
  options.recording.selection.listed = run.frames;
  options.recording.listed_colours = run.images;
  return run;
}

/// Rejects an incomplete box, which must not be joined. @throws std::runtime_error
void checkBox(const ReconstructionResult& result) {
  if (result.map.refused_blocks == 0 && result.map.refused_cubes == 0) return;
  throw std::runtime_error(
      "the box needs more memory than map/max_memory_mb; raise it, use smaller boxes, or set "
      "map/page_folder");
}

void run(ReconstructOptions options) {
  completeInput(options);
  if (options.recording.format == "journal") return runJournal(options);
  if (!options.poses_frame.empty()) throw UsageError("--poses-frame is for journals");
  const RunSettings settings = readSettings(options, defaultsFor(options));
  options.recording.first_pose_only = settings.params.poses.mode == PoseMode::kTrack;
  checkOutputs(options);
  std::shared_ptr<const MapChunks> loaded;
  MapperParams params = settings.params.mapper;
  if (!options.load_map_path.empty()) {
    loaded = std::make_shared<const MapChunks>(options.load_map_path, params);
    params = settingsWith(loaded->head(), settings);
  }
  auto frames = options.only.empty() ? openAndInspect(options, settings) : nullptr;
  if (frames && frames->posed() && frames->size()) {
    requireMost(*frames->posed(), *frames->size(), options, "have a pose");
  }
  const MapOrigin origin = originOf(options, settings, loaded ? &loaded->head() : nullptr);
  std::optional<BoxRun> box = prepareBox(options, settings, loaded.get(), params.map, origin);
  if (box) frames = openFrames(options, settings.params);

  const auto source = readAhead(levelled(std::move(frames), origin.T_W_M));
  auto colours = openColours(options, settings.params);
  // When tracking, colour poses are relative to the depth camera.
  if (!options.recording.first_pose_only) colours = levelled(std::move(colours), origin.T_W_M);
  const auto mapper = loaded ? makeProbedMapper(params, settings.rules, partsOf(loaded))
                             : makeProbedMapper(params, settings.rules);
  // imagesFor() has already applied this rate to the images of a box.
  RecordedInput input(*source, colours.get(), box ? 0.0 : settings.params.max_colour_rate_hz);
  if (loaded) input.map_stamp_s = loaded->head().stamp_s;
  loaded.reset();  // the mapper has copied it
  input.poses = settings.params.poses;
  input.threads = params.threads;
  if (box) {
    mapper->restrictTo(box->extent);
    input.box = &*box;
    input.supporting = [&] { return mapper->supportingFrames(); };
  }
  ReconstructionResult result;
  {
    ProgressBar progress("frames", source->posed() ? source->posed() : source->size());
    result = reconstruct(input, *mapper, params.map, options.mesh_every,
                         [&](size_t done) { progress.show(done); });
  }
  if (box) checkBox(result);
  saveAll(result, *mapper, origin, params, options, box ? &box->box : nullptr);
  if (!box) requireMost(result.frames, depthImages(result), options, "were fused (and saved)");
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("reconstruct", argc, argv, dtsdf::parseReconstructOptions, dtsdf::run);
}
