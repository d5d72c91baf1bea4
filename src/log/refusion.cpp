#include "log/refusion.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/map_file.h"
#include "kernels/core/grid.h"

namespace dtsdf {
namespace {

/// So that the whole mesh need not be made at once when the maps are swapped.
constexpr size_t kCallsPerMesh = 64;
/// How often the memory is looked at: to ask for it is to wait for a GPU.
constexpr size_t kCallsPerCheck = 8;

std::string inMb(size_t bytes) { return std::to_string(bytes >> 20) + " MB"; }

std::string tooLarge(size_t live_bytes, size_t second_bytes, size_t max_bytes) {
  return "the map takes " + inMb(live_bytes) + " and a corrected one beside it " +
         inMb(second_bytes) + ", more than the " + inMb(max_bytes) +
         " of map/max_memory_mb; raise it";
}

}  // namespace

std::string whyTooLarge(const MapStats& live) {
  if (2 * live.map_bytes <= live.max_map_bytes) return "";
  return tooLarge(live.map_bytes, live.map_bytes, live.max_map_bytes);
}

Refusion::Refusion(const std::string& log_folder, const MapperParams& run,
                   const LogCorrection& correction)
    : replay_(log_folder), correction_(correction) {
  effect_ = replay_.correct(correction_);
  correction_.first_moved = effect_.first_moved;
  next_number_ = replay_.log().firstNumber() + 1;
  params_ = readMapperParams(replay_.settings());
  params_.backend = run.backend;
  params_.threads = run.threads;
}

void Refusion::make() {
  stamp_s_ = replay_.log().begin().stamp_s;
  if (replay_.log().baseMap().empty()) {
    mapper_ = makeMapper(params_);
  } else {
    mapper_ = makeMapper(params_, loadMap(replay_.log().baseMap(), params_, params_.threads));
  }
}

bool Refusion::step(size_t live_bytes) {
  if (mapper_ == nullptr) {
    make();
    return true;
  }
  const std::optional<LogCall> call = replay_.next();
  if (!call) return replay_.readOn();
  const IntegrationResult result = apply(*call, *mapper_);
  if (std::holds_alternative<LoggedDepth>(call->content)) {
    ++fused_;
    if (result.status == FrameStatus::kFused) stamp_s_ = call->stamp_s;
  } else if (std::holds_alternative<LoggedColour>(call->content) &&
             result.status == FrameStatus::kFused) {
    stamp_s_ = std::max(stamp_s_, call->stamp_s);  // colour may come late
  }
  ++calls_since_mesh_;
  if (calls_since_mesh_ % kCallsPerCheck == 0) checkMemory(live_bytes);
  if (calls_since_mesh_ >= kCallsPerMesh) extract();
  return true;
}

uint64_t Refusion::nextNumber() const {
  const auto& items = replay_.poses().items();
  return items.empty() ? next_number_ : items.back().entry.head.number + 1;
}

void Refusion::checkMemory(size_t live_bytes) const {
  const MapStats stats = mapper_->stats();
  if (live_bytes + stats.map_bytes <= stats.max_map_bytes) return;
  throw std::runtime_error(tooLarge(live_bytes, stats.map_bytes, stats.max_map_bytes));
}

void Refusion::extract() {
  for (BlockMesh& block : mapper_->updateMesh().blocks) {
    const PackedKey key = packKey(block.key);
    if (block.triangles.empty()) {
      mesh_.erase(key);
    } else {
      mesh_[key] = std::move(block);
    }
  }
  calls_since_mesh_ = 0;
}

std::map<PackedKey, BlockMesh> Refusion::takeMesh() {
  if (calls_since_mesh_ > 0) extract();
  return std::move(mesh_);
}

}  // namespace dtsdf
