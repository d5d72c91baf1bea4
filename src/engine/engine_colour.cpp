// The way of a colour image through the engine.
#include <utility>

#include "backend/frame_check.h"
#include "engine/engine.h"
#include "kernels/colour/surface_point.h"

namespace dtsdf {

IntegrationResult Engine::paint(const ColourFrame& frame) {
  if (const auto problem = findProblem(frame, params_)) return refuse(*problem);
  return timed([&] { return paintSurfaces(frame); });
}

/// The way of a colour image.
IntegrationResult Engine::paintSurfaces(const ColourFrame& frame) {
  ready();
  forgetWhatIsMarked();
  backend_->takeColours(frame);
  const FrameView view = makeFrameView(frame, params_.map.voxel_size_m);
  std::vector<int32_t> in_view = table_.slotsInView(view, pointRadius(rules_.colour));
  settle();
  const size_t left_on_disk = pager_ ? bringInForImage(view, in_view) : 0;
  const SeenColours seen = backend_->look({view, leastEvidenceNow(), in_view});
  exposure_ = exposureOf(seen.sums, exposure_, paint_settings_);
  if (!seen.any) return nothingToPaint();
  IntegrationResult result;
  result.refused_blocks = left_on_disk + admitColours();
  if (has_colours_) backend_->paint(exposure_);
  return result;
}

/// As admit(). @return the number of bricks refused.
size_t Engine::admitColours() {
  backend_->waitForMeshes();
  std::vector<ColourRequest> requests = backend_->colourRequests();
  const size_t new_bricks = table_.countNewColours(requests);
  if (pager_) pager_->makeRoom(*backend_, new_bricks * BlockTable::kColourBytes);
  backend_->reserveColours(new_bricks);
  const ColourAdmission admission = table_.admitColours(std::move(requests));
  enterColours(admission.bricks);
  counters_.refused += admission.refused;
  return admission.refused;
}

/// What was meshed without colours gets them with the first ones.
void Engine::enterColours(const std::vector<NewBrick>& bricks) {
  if (bricks.empty()) return;
  if (!has_colours_) keepColours();
  has_colours_ = true;
  backend_->enterColours(bricks);
}

void Engine::keepColours() {
  backend_->keepColours();
  if (pager_) pager_->keepColours();
}

}  // namespace dtsdf
