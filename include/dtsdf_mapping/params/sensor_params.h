/// What is known of the sensor that the depth images come from.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// How the noise of depth grows with depth; its scale is estimated from the images.
enum class Sensor {
  kStructuredLight,  ///< Noise uniform in inverse depth, as triangulation has it (z^2).
  kStereo,           ///< The same.
  kTimeOfFlight,     ///< Noise uniform in depth.
};

/// The sensor that depth images come from.
struct SensorParams {
  Sensor kind = Sensor::kStructuredLight;  ///< How its noise grows.
};

/// Visits each member with its key and its rule.
/// @relates SensorParams
template <class Visitor>
void visitParams(SensorParams& p, Visitor& visit) {
  visit("input/sensor", p.kind,
        EnumNames<Sensor>{{"structured_light", Sensor::kStructuredLight},
                          {"stereo", Sensor::kStereo},
                          {"time_of_flight", Sensor::kTimeOfFlight}});
}

}  // namespace dtsdf
