/// Says once that colour is published, but not on the topic that is waited for.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "ros/common/steady_clock.h"
#include "ros/input/camera_report.h"

namespace dtsdf {

/// Most depth cameras come without colour, so a map without is no trouble; but who set a wrong
/// topic would never learn why the mesh is grey.
class ColourHint {
 public:
  /// Colour may start later than depth.
  static constexpr std::chrono::seconds kPatience{10};

  /// Of each status; the camera whose colour is worth a look, at most once.
  const CameraReport* update(const std::vector<CameraReport>& cameras, SteadyTime now) {
    if (is_done_) return nullptr;
    const auto place = std::find_if(cameras.begin(), cameras.end(), lacksColour);
    if (place == cameras.end()) {
      since_.reset();
      return nullptr;
    }
    if (!since_) since_ = now;
    if (now - *since_ < kPatience) return nullptr;
    is_done_ = true;
    return &*place;
  }

 private:
  /// Colour that has to be there is a matter of the status.
  static bool lacksColour(const CameraReport& camera) {
    return camera.depth.frames.fused > 0 && camera.colour && !camera.is_colour_needed &&
           camera.colour->frames.images == 0 && camera.colour->image_publishers == 0;
  }

  std::optional<SteadyTime> since_;
  bool is_done_ = false;
};

}  // namespace dtsdf
