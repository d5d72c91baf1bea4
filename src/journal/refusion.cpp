#include "journal/refusion.h"

#include <stdexcept>
#include <utility>

namespace dtsdf {
namespace {

/// Number of journal::Calls between mesh updates. With frequent updates, little is left to do when
/// the second map replaces the live one.
constexpr size_t kCallsPerMesh = 64;
/// Number of calls between memory checks, each of which waits until the GPU has finished its work.
constexpr size_t kCallsPerCheck = 8;
/// With fewer calls since the last update, the mesh is not updated until the maps are swapped.
constexpr size_t kMinCallsPerMesh = 8;

std::string inMb(size_t bytes) { return std::to_string(bytes >> 20) + " MB"; }

}  // namespace

std::string whyTooLarge(size_t live_bytes, size_t second_bytes, size_t max_bytes) {
  if (live_bytes + second_bytes <= max_bytes) return "";
  return "the map needs " + inMb(live_bytes) + " and the corrected map " + inMb(second_bytes) +
         ", together more than " + inMb(max_bytes) + "; raise map/max_memory_mb";
}

Refusion::Refusion(const std::string& path, const MapperParams& run, journal::Correction correction)
    : replay_(path), correction_(std::move(correction)) {
  if (replay_.count() < correction_.before) {
    throw std::runtime_error("a part of the map is missing from the journal");
  }
  effect_ = replay_.correct(correction_);
  MapperParams params = readMapperParams(replay_.begin().settings);
  params.backend = run.backend;
  params.threads = run.threads;
  if (effect_.moved == 0) return;
  mapper_ = mapperOf(replay_, params);
  calls_since_mesh_ = replay_.map() == nullptr ? 0 : 1;
}

bool Refusion::step(size_t live_bytes) {
  std::optional<journal::Call> call = replay_.next();
  if (!call && replay_.readAppended()) call = replay_.next();
  if (call) {
    const IntegrationResult result = repeatCall(*call, *mapper_);
    if (result.status == FrameStatus::kNoMemory) throw std::runtime_error(result.message);
    const auto* const image = std::get_if<journal::Image>(&*call);
    fused_ += image != nullptr && std::holds_alternative<DepthFrame>(image->frame);
    if (++calls_since_mesh_ % kCallsPerCheck == 0) checkMemory(live_bytes);
    if (calls_since_mesh_ >= kCallsPerMesh) extract();
    return true;
  }
  if (calls_since_mesh_ < kMinCallsPerMesh) return false;
  extract();
  return true;
}

void Refusion::checkMemory(size_t live_bytes) {
  const MapStats stats = mapper_->stats();
  bytes_ = stats.map_bytes;
  const std::string problem = whyTooLarge(live_bytes, stats.map_bytes, stats.max_map_bytes);
  if (!problem.empty()) throw std::runtime_error(problem);
}

void Refusion::extract() {
  MeshUpdate update = mapper_->updateMesh();
  for (BlockMesh& block : update.blocks) {
    mesh_.put(std::make_shared<const BlockMesh>(std::move(block)));
  }
  calls_since_mesh_ = 0;
}

const std::map<PackedKey, SharedBlockMesh>& Refusion::takeMesh() {
  if (calls_since_mesh_ > 0) extract();
  return mesh_.blocks();
}

}  // namespace dtsdf
