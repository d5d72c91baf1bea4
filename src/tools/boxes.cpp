#include "tools/boxes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <regex>
#include <stdexcept>
#include <unordered_set>

#include "dtsdf_mapping/io/rate_limit.h"
#include "io/text_file.h"
#include "kernels/space/cells.h"
#include "level/frame_points.h"
#include "mapper/probed_mapper.h"
#include "params/text.h"
#include "tools/camera_view.h"

namespace dtsdf {
namespace {

constexpr int32_t kMax = kMaxBlockCoordinate;
constexpr int32_t BlockKey::*kAxes[] = {&BlockKey::x, &BlockKey::y, &BlockKey::z};
constexpr char kAxisNames[] = "xyz";

/// Minimum number of images that planBoxes() samples, at equal intervals; if there are fewer, it
/// samples all.
constexpr size_t kSampledImages = 256;
constexpr int kSampledPixels = 64;  ///< Pixels sampled along each axis of an image.

std::string edgeText(int32_t block, int32_t open, double block_m) {
  return block == open ? "" : formatted("%.7g", block * block_m);
}

[[noreturn]] void throwForm(const std::string& box) {
  throw UsageError("'" + box +
                   "' is not of the form x=FROM..TO,y=FROM..TO,z=FROM..TO, in metres; FROM and TO "
                   "may be left out");
}

int32_t readEdge(const std::string& text, int32_t open, double block_m, const std::string& box) {
  if (text.empty()) return open;
  double metres = 0.0;
  if (!parseNumber(text, metres) || !(std::abs(metres / block_m) < kMax)) throwForm(box);
  return static_cast<int32_t>(std::lround(metres / block_m));
}

/// @throws std::runtime_error for settings that need the whole map.
void checkSettings(const RunSettings& settings) {
  const MapperParams& params = settings.params.mapper;
  if (params.map.keep_radius_m > 0.0f) {
    throw std::runtime_error(
        "map/keep_radius_m needs the whole map, so it cannot be used with --only; leave it at 0");
  }
  if (settings.params.poses.mode != PoseMode::kTf) {
    throw std::runtime_error(
        "--only fuses images at the given poses: poses/mode must be tf, since "
        "other modes need the whole map");
  }
}

/// @throws std::runtime_error if painting the box requires the whole map.
void checkPainting(const MapperParams& params) {
  if (!params.adapt_exposure && params.max_paint_depth_m > 0.0f) return;
  throw std::runtime_error(
      "with --only, painting requires a fixed exposure and a depth limit: give --set "
      "colour/exposure=fixed colour/max_depth_m=5 for every box, or turn painting off with "
      "colour/enabled=never");
}

/// Number of blocks along an edge of a cube of free-space cells. A cube belongs to the box that
/// contains its first block.
int blocksPerCube(const SpaceParams& space) { return space.cell_voxels * kCubeSide / kBlockSide; }

/// The keys of the cubes that belong to a box; empty if the box contains no cube's first block.
BlockExtent cubesOf(const BlockExtent& box, int n) {
  BlockExtent cubes;
  for (const auto axis : kAxes) {
    cubes.first.*axis = -floorDivided(-(box.first.*axis), n);
    cubes.last.*axis = floorDivided(box.last.*axis, n);
  }
  return cubes;
}

/// Returns the indices of the colour images that may paint the box. Extends the blocks of the run
/// to those that may occlude surfaces of the box in these images.
std::vector<size_t> imagesFor(BoxRun& run, double first_stamp_s, const RunOptions& options,
                              const RunSettings& settings,
                              const std::optional<Eigen::Isometry3d>& T_W_M) {
  std::vector<size_t> listed;
  const auto images = levelled(openColours(options, settings.params), T_W_M);
  if (images == nullptr) return listed;
  const MapperParams& params = settings.params.mapper;
  const ColourRules& rules = settings.rules.colour;
  checkPainting(params);
  RateLimit rate(settings.params.max_colour_rate_hz);
  run.extent.blocks = grown(run.extent.painted, 1, 1);
  while (const std::optional<SourceColour> image = images->next()) {
    if (!rate.takes(image->stamp_s)) continue;
    if (image->stamp_s < first_stamp_s || image->stamp_s > run.last_stamp_s) continue;
    const CameraView view(image->colour);
    if (!mayPaint(view, run.extent.painted, params, rules)) continue;
    listed.push_back(image->index);
    const BlockExtent hiding = blocksThatHide(view, run.extent.painted, params, rules);
    run.extent.blocks = around(run.extent.blocks, hiding);
  }
  return listed;
}

/// Painting depends on how many frames have touched the map so far, up to mesh/min_support. So the
/// first frames are fused even if the box is not in view. @return the index of the first frame that
/// need not be fused.
size_t firstOptionalFrame(RunOptions options, const RunSettings& settings,
                          const std::optional<Eigen::Isometry3d>& T_W_M) {
  const MapperParams& params = settings.params.mapper;
  options.recording.poses_only = false;
  const auto mapper = makeProbedMapper(params, settings.rules);
  mapper->restrictTo({noBlocks(), noBlocks(), noBlocks()});
  const auto frames = levelled(openFrames(options, settings.params), T_W_M);
  size_t end = 0;
  while (mapper->supportingFrames() < static_cast<uint64_t>(params.mesh.min_support)) {
    const std::optional<SourceFrame> frame = frames->next();
    if (!frame) break;
    mapper->integrate(frame->depth);
    end = frame->index + 1;
  }
  return end;
}

/// A box, and the sampled blocks in it.
struct Leaf {
  BlockExtent box;
  std::vector<BlockKey> blocks;

  BlockExtent bounds() const {
    BlockExtent bounds{blocks.front(), blocks.front()};
    for (const BlockKey& key : blocks) bounds = around(bounds, {key, key});
    return bounds;
  }
  bool operator<(const Leaf& other) const { return blocks.size() < other.blocks.size(); }
};

/// The longest axis, and its length in blocks.
std::pair<int, int32_t> longestAxis(const BlockExtent& bounds) {
  std::pair<int, int32_t> longest{0, 0};
  for (int i = 0; i < 3; ++i) {
    const int32_t length = bounds.last.*kAxes[i] - bounds.first.*kAxes[i] + 1;
    if (length > longest.second) longest = {i, length};
  }
  return longest;
}

/// Splits a leaf into two with about the same number of blocks. @pre The leaf has at
/// least two blocks.
std::array<Leaf, 2> halvesOf(Leaf leaf) {
  const BlockExtent bounds = leaf.bounds();
  const auto axis = kAxes[longestAxis(bounds).first];
  const auto middle = leaf.blocks.begin() + static_cast<std::ptrdiff_t>(leaf.blocks.size() / 2);
  std::nth_element(leaf.blocks.begin(), middle, leaf.blocks.end(),
                   [axis](const BlockKey& a, const BlockKey& b) { return a.*axis < b.*axis; });
  const int32_t cut = std::max((*middle).*axis, bounds.first.*axis + 1);
  std::array<Leaf, 2> halves{Leaf{leaf.box, {}}, Leaf{leaf.box, {}}};
  halves[0].box.last.*axis = cut - 1;
  halves[1].box.first.*axis = cut;
  for (const BlockKey& key : leaf.blocks) halves[key.*axis < cut ? 0 : 1].blocks.push_back(key);
  return halves;
}

/// The blocks that contain measured points in a sample of the recording's images.
std::vector<BlockKey> sampleBlocks(RunOptions options, const RunSettings& settings) {
  const auto T_W_M = detectLevel(options, settings);
  const MapperParams& params = settings.params.mapper;
  const double block_m = static_cast<double>(params.map.voxel_size_m) * kBlockSide;
  std::vector<size_t> indices;
  options.recording.poses_only = true;
  const auto poses = openFrames(options, settings.params);
  while (const std::optional<SourceFrame> frame = poses->next()) indices.push_back(frame->index);
  const size_t step = std::max<size_t>(1, indices.size() / kSampledImages);
  std::vector<size_t> sampled;
  for (size_t i = 0; i < indices.size(); i += step) sampled.push_back(indices[i]);
  options.recording.poses_only = false;
  options.recording.selection.listed = std::make_shared<std::vector<size_t>>(sampled);
  const auto source = levelled(openFrames(options, settings.params), T_W_M);
  std::unordered_set<PackedKey> keys;
  while (const std::optional<SourceFrame> frame = source->next()) {
    for (const Eigen::Vector3d& p_C : thinnedPoints(frame->depth, kSampledPixels, kSampledPixels)) {
      const auto depth_m = static_cast<float>(p_C.z());
      if (depth_m < params.fusion.min_depth_m || depth_m > params.fusion.max_depth_m) continue;
      const Eigen::Vector3d block = (frame->depth.T_W_C * p_C / block_m).array().floor();
      if (!(block.cwiseAbs().maxCoeff() <= kMax)) continue;
      keys.insert(packKey(BlockKey{int32_t(block.x()), int32_t(block.y()), int32_t(block.z())}));
    }
  }
  std::vector<BlockKey> blocks;
  for (const PackedKey key : keys) blocks.push_back(unpackKey(key));
  return blocks;
}

/// Adds the parts of `whole` outside `box` to `left`, cut along the faces of `box`.
void subtractBox(const BlockExtent& box, BlockExtent whole, std::vector<BlockExtent>& left) {
  for (const auto axis : kAxes) {
    if (whole.first.*axis < box.first.*axis) {
      left.push_back(whole);
      left.back().last.*axis = box.first.*axis - 1;
      whole.first.*axis = box.first.*axis;
    }
    if (whole.last.*axis > box.last.*axis) {
      left.push_back(whole);
      left.back().first.*axis = box.last.*axis + 1;
      whole.last.*axis = box.last.*axis;
    }
  }
}

}  // namespace

std::string boxText(const BlockExtent& box, double block_m) {
  std::string text;
  for (int i = 0; i < 3; ++i) {
    text += (i == 0 ? "" : ",") + std::string(1, kAxisNames[i]) + "=" +
            edgeText(box.first.*kAxes[i], -kMax, block_m) + ".." +
            (box.last.*kAxes[i] == kMax ? "" : edgeText(box.last.*kAxes[i] + 1, kMax, block_m));
  }
  return text;
}

BlockExtent parseBox(const std::string& text, double block_m) {
  static const std::regex kForm(
      R"(x=([^,]*?)\.\.([^,]*),y=([^,]*?)\.\.([^,]*),z=([^,]*?)\.\.([^,]*))");
  std::smatch edges;
  if (!std::regex_match(text, edges, kForm)) throwForm(text);
  BlockExtent box;
  for (size_t i = 0; i < 3; ++i) {
    box.first.*kAxes[i] = readEdge(edges[2 * i + 1], -kMax, block_m, text);
    box.last.*kAxes[i] = readEdge(edges[2 * i + 2], kMax + 1, block_m, text) - 1;
    if (box.first.*kAxes[i] > box.last.*kAxes[i]) throw UsageError("'" + text + "' is empty");
  }
  return box;
}

BoxRun planBoxRun(RunOptions options, const RunSettings& settings,
                  const std::optional<Eigen::Isometry3d>& T_W_M, const BlockExtent& box) {
  checkSettings(settings);
  options.recording.poses_only = true;
  const MapperParams& params = settings.params.mapper;
  BoxRun run;
  run.box = {box.first, box.last, 1, {}, {}};
  run.extent = {box, box, cubesOf(box, blocksPerCube(params.space))};
  std::vector<std::pair<size_t, CameraView>> views;
  double first_stamp_s = 0.0;
  const auto source = levelled(openFrames(options, settings.params), T_W_M);
  while (const std::optional<SourceFrame> frame = source->next()) {
    if (views.empty()) first_stamp_s = frame->stamp_s;
    run.last_stamp_s = frame->stamp_s;
    views.emplace_back(frame->index, frame->depth);
  }
  const std::vector<size_t> images = imagesFor(run, first_stamp_s, options, settings, T_W_M);
  const size_t first_needed = images.empty() ? 0 : firstOptionalFrame(options, settings, T_W_M);
  const int beyond = params.space.enabled ? blocksPerCube(params.space) - 1 : 0;
  const BlockExtent fused = around(run.extent.blocks, grown(box, 0, beyond));
  std::vector<size_t> frames;
  for (const auto& [index, view] : views) {
    if (index < first_needed || mayFuse(view, fused, params)) frames.push_back(index);
  }
  run.images = std::make_shared<std::vector<size_t>>(images);
  run.frames = std::make_shared<std::vector<size_t>>(frames);
  return run;
}

std::vector<BlockExtent> planBoxes(const RunOptions& options, const RunSettings& settings,
                                   size_t count, double edge_m) {
  const double block_m = static_cast<double>(settings.params.mapper.map.voxel_size_m) * kBlockSide;
  const double edge_blocks = edge_m > 0.0 ? std::max(1.0, edge_m / block_m) : 1e9;
  const size_t most = count > 0 ? count : size_t{1} << 30;
  std::priority_queue<Leaf> leaves;
  leaves.push({BlockExtent(), sampleBlocks(options, settings)});
  if (leaves.top().blocks.empty()) {
    throw std::runtime_error("no surface is visible in the sampled images, so there are no boxes");
  }
  std::vector<BlockExtent> boxes;
  while (!leaves.empty() && leaves.size() + boxes.size() < most) {
    Leaf leaf = leaves.top();
    leaves.pop();
    const int32_t length = longestAxis(leaf.bounds()).second;
    if (length <= (count > 0 ? 1.0 : edge_blocks)) {
      boxes.push_back(leaf.box);
      continue;
    }
    for (Leaf& half : halvesOf(std::move(leaf))) leaves.push(std::move(half));
  }
  for (; !leaves.empty(); leaves.pop()) boxes.push_back(leaves.top().box);
  if (boxes.size() >= count) return boxes;
  throw std::runtime_error("the surfaces lie in too few blocks for " + std::to_string(count) +
                           " boxes; ask for " + std::to_string(boxes.size()) + " at most");
}

std::vector<BlockExtent> missingBoxes(const std::vector<BlockExtent>& boxes) {
  std::vector<BlockExtent> missing{BlockExtent()};
  for (const BlockExtent& box : boxes) {
    uint64_t covered = 0;
    std::vector<BlockExtent> left;
    for (const BlockExtent& piece : missing) {
      if (!overlap(piece, box)) {
        left.push_back(piece);
        continue;
      }
      covered += volumeOf(intersectionOf(piece, box));
      subtractBox(box, piece, left);
    }
    if (covered != volumeOf(box)) throw std::runtime_error("two boxes overlap; omit one of them");
    missing = std::move(left);
  }
  if (missing.empty()) return missing;
  BlockExtent all = missing.front();
  uint64_t volume = 0;
  for (const BlockExtent& piece : missing) {
    all = around(all, piece);
    volume += volumeOf(piece);
  }
  if (volume == volumeOf(all)) return {all};
  return missing;
}

}  // namespace dtsdf
