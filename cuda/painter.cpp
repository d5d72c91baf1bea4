#include "painter.h"

#include <algorithm>

#include "backend/frame_check.h"
#include "map/sort_by_key.h"
#include "runtime/device.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kThreadBlocksPerProcessor = 16;

/// One request for each block, of those for its arrays.
std::vector<ColourRequest> byBlocks(std::vector<ColourRequest> requests) {
  sortByKey(requests);
  size_t blocks = 0;
  for (const ColourRequest& request : requests) {
    if (blocks > 0 && requests[blocks - 1].key == request.key) {
      requests[blocks - 1].bricks |= request.bricks;
    } else {
      requests[blocks++] = request;
    }
  }
  requests.resize(blocks);
  return requests;
}

}  // namespace

Painter::Painter(const PaintSettings& settings, const Stream& stream)
    : settings_(settings),
      stream_(stream),
      thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
      counters_(1),
      pinned_counters_(1) {}

void Painter::reserveImages(int32_t width, int32_t height) {
  const int32_t cells_across = cellsFor(width), cells_down = cellsFor(height);
  const ColourImage layout = layOut(nullptr, width, height);
  pixels_.reserveExactly(static_cast<size_t>(pixelCount(layout)), image_stream_);
  hiding_m_.reserveExactly(static_cast<size_t>(cells_across) * cells_down, image_stream_);
  // Room for a sample a pixel at first: images seldom show more voxels than they have pixels.
  samples_.reserveExactly(static_cast<size_t>(width) * height, stream_);
  sensing_.image = layOut(pixels_.data(), width, height);
  sensing_.hiding = {hiding_m_.data(), cells_across, cells_down};
}

/// Nobody reads what the image before has left there: its counters have been waited for, unless
/// looking at it failed. With a profile nothing runs beside each other.
void Painter::takeImage(const ColourFrame& frame) {
  if (is_looking_ || profileOf(image_stream_) != nullptr) stream_.synchronize();
  is_looking_ = false;
  reserveImages(frame.width, frame.height);
  {
    const StageSpan span(image_stream_, Stage::kPaint);
    clearHiding(sensing_.hiding, hiding_m_.data(), image_stream_);
  }
  raw_image_.upload(rowsOf(frame), image_stream_);
  const StageSpan span(image_stream_, Stage::kPaint);
  takePixels(raw_image_.data(), layoutOf(frame.encoding), pixels_.data(),
             static_cast<size_t>(frame.width) * frame.height, image_stream_);
  halveImage(sensing_.image, pixels_.data(), image_stream_);
  image_stream_.record(taken_);
}

void Painter::look(const PaintView& look, const BlockExtent& painted, const MapView& map) {
  painted_ = painted;
  sensing_.view = {look.view,       settings_.directional, look.least_evidence,
                   settings_.rules, settings_.max_depth_m, settings_.full_weight_depth_m};
  takeCandidates(look.in_view);
  stream_.waitFor(taken_);
  findHiding(map);
  findSamples(map);
  while (counters().samples > samples_.capacity()) {
    samples_.reserve(counters().samples, stream_);
    findHiding(map);
    findSamples(map);
  }
}

/// Those of the image before have been read: its counters have been waited for.
void Painter::takeCandidates(const std::vector<int32_t>& in_view) {
  candidate_count_ = static_cast<uint32_t>(in_view.size());
  candidates_.reserve(in_view.size());
  arrays_.reserve(in_view.size() * kDirectionCount, stream_);
  requests_.reserve(in_view.size() * kDirectionCount, stream_);
  std::copy(in_view.begin(), in_view.end(), candidates_.data());
}

void Painter::findHiding(const MapView& map) {
  is_looking_ = true;
  const StageSpan span(stream_, Stage::kPaint);
  counters_.zero(stream_);
  findArraysInView(sensing_.view, map, view(), stream_);
  drawHiding(sensing_.view, map, view(), hiding_m_.data(), stream_);
}

void Painter::findSamples(const MapView& map) {
  {
    const StageSpan span(stream_, Stage::kPaint);
    lookAtSurfaces(sensing_, map, view(), stream_);
  }
  counters_.download(pinned_counters_.data(), 1, stream_);
  stream_.record(looked_);
  looked_.wait();
  is_looking_ = false;
}

std::vector<ColourRequest> Painter::fetchRequests() {
  const size_t count = counters().requests;
  if (count == 0) return {};
  pinned_requests_.reserve(count);
  requests_.download(pinned_requests_.data(), count, stream_);
  stream_.synchronize();
  return byBlocks({pinned_requests_.data(), pinned_requests_.data() + count});
}

void Painter::paint(const Exposure& exposure, const MapView& map) {
  const StageSpan span(stream_, Stage::kPaint);
  paintSurfaces(settings_.rules, exposure, map, view(), counters().samples, stream_);
}

void Painter::addMemory(std::vector<MemoryPart>& parts) const {
  const size_t images = pixels_.bytes() + hiding_m_.bytes();
  parts.push_back({"colour image", MemoryKind::kScratch, images, images});
  const size_t lists = samples_.bytes() + arrays_.bytes() + requests_.bytes() + counters_.bytes();
  parts.push_back({"voxels to paint", MemoryKind::kScratch, lists, lists});
  const size_t staging = pinned_counters_.bytes() + pinned_requests_.bytes() + candidates_.bytes();
  parts.push_back({"voxels to paint", MemoryKind::kStaging, staging, staging});
  raw_image_.addMemory("raw colour image", parts);
}

}  // namespace gpu
}  // namespace dtsdf
