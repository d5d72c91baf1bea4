#include "journal/refusion.h"

#include <stdexcept>
#include <utility>

namespace dtsdf {
namespace {

/// After how many images the memory is measured, for which a GPU has to be waited for.
constexpr size_t kImagesPerCheck = 8;

std::string inMb(size_t bytes) { return std::to_string(bytes >> 20) + " MB"; }

}  // namespace

std::string whyTooLarge(size_t live_bytes, size_t second_bytes, size_t max_bytes) {
  if (live_bytes + second_bytes <= max_bytes) return "";
  return "the map takes " + inMb(live_bytes) + " and a corrected one beside it " +
         inMb(second_bytes) + ", more than the " + inMb(max_bytes) +
         " of map/max_memory_mb; raise it";
}

Refusion::Refusion(const std::string& path, const MapperParams& run, journal::Correction by)
    : replay(path), correction(std::move(by)) {
  if (replay.count() < correction.before) {
    throw std::runtime_error("the journal lacks a part of the map");
  }
  effect = replay.correct(correction);
  MapperParams params = readMapperParams(replay.begin().settings);
  params.backend = run.backend;
  params.threads = run.threads;
  if (effect.moved > 0) mapper = mapperOf(replay, params);
}

bool Refusion::step(size_t live_bytes) {
  std::optional<journal::Call> call = replay.next();
  if (!call && replay.readOn()) call = replay.next();
  if (!call) return false;
  const IntegrationResult result = doAgain(*call, *mapper);
  if (result.status == FrameStatus::kNoMemory) throw std::runtime_error(result.message);
  const auto* const image = std::get_if<journal::Image>(&*call);
  if (image == nullptr || !std::holds_alternative<DepthFrame>(image->frame)) return true;
  if (++fused % kImagesPerCheck != 0) return true;
  const MapStats stats = mapper->stats();
  bytes = stats.map_bytes;
  const std::string problem = whyTooLarge(live_bytes, bytes, stats.max_map_bytes);
  if (!problem.empty()) throw std::runtime_error(problem);
  return true;
}

}  // namespace dtsdf
