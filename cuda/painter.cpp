#include "painter.h"

#include "backend/frame_check.h"
#include "runtime/device.h"
#include "runtime/stage_clock.h"

namespace dtsdf {
namespace gpu {
namespace {

constexpr int kThreadBlocksPerProcessor = 8;

}  // namespace

Painter::Painter(const ColourRules& rules, bool directional, const Stream& stream)
    : rules_(rules),
      directional_(directional),
      stream_(stream),
      thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
      counters_(1),
      pinned_counters_(1) {}

void Painter::reserve(const ColourFrame& frame, size_t slots) {
  const int32_t width = cellsFor(frame.width), height = cellsFor(frame.height);
  const ColourImage layout = layOut(nullptr, frame.width, frame.height);
  pinned_pixels_.reserve(static_cast<size_t>(frame.width) * frame.height);
  pixels_.reserveExactly(static_cast<size_t>(pixelCount(layout)), stream_);
  hiding_m_.reserveExactly(static_cast<size_t>(width) * height, stream_);
  slots_.reserve(slots, stream_);
  requests_.reserve(slots, stream_);
  sensing_.image = layOut(pixels_.data(), frame.width, frame.height);
  sensing_.hiding = {hiding_m_.data(), width, height};
}

void Painter::look(const ColourFrame& frame, const FrameView& frame_view, int32_t least_evidence,
                   const MapView& map) {
  reserve(frame, map.slot_count);
  sensing_.view = {frame_view, directional_, least_evidence, rules_};
  counters_.zero(stream_);
  // The image before has left the pinned memory: its counters have been waited for.
  copyPixels(frame, 0, frame.height, pinned_pixels_.data());
  {
    const StageSpan span(stream_, Stage::kPaint);
    pixels_.upload(pinned_pixels_.data(), static_cast<size_t>(frame.width) * frame.height,
                   stream_);
    halveImage(sensing_.image, pixels_.data(), stream_);
    findBlocksInView(sensing_.view, map, view(), stream_);
    drawHiding(sensing_, map, view(), hiding_m_.data(), stream_);
    lookAtSurfaces(sensing_, map, view(), stream_);
  }
  counters_.download(pinned_counters_.data(), 1, stream_);
  stream_.record(looked_);
  looked_.wait();
  exposure_ = exposureOf(counters().sums, exposure_, rules_);
}

std::vector<ColourRequest> Painter::fetchRequests() {
  const size_t count = counters().requests;
  pinned_requests_.reserve(count);
  requests_.download(pinned_requests_.data(), count, stream_);
  stream_.synchronize();
  return {pinned_requests_.data(), pinned_requests_.data() + count};
}

void Painter::paint(const MapView& map) {
  const StageSpan span(stream_, Stage::kPaint);
  paintSurfaces(sensing_, exposure_, map, view(), stream_);
}

void Painter::addMemory(std::vector<MemoryPart>& parts) const {
  const size_t images = pixels_.bytes() + hiding_m_.bytes();
  parts.push_back({"colour image", MemoryKind::kScratch, images, images});
  const size_t lists = slots_.bytes() + requests_.bytes() + counters_.bytes();
  parts.push_back({"blocks to paint", MemoryKind::kScratch, lists, lists});
  const size_t staging =
      pinned_pixels_.bytes() + pinned_counters_.bytes() + pinned_requests_.bytes();
  parts.push_back({"colour image", MemoryKind::kStaging, staging, staging});
}

}  // namespace gpu
}  // namespace dtsdf
