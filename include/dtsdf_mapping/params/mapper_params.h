/// All settings of a mapper.
#pragma once

#include "dtsdf_mapping/params/fusion_params.h"
#include "dtsdf_mapping/params/map_params.h"
#include "dtsdf_mapping/params/mesh_params.h"
#include "dtsdf_mapping/params/space_params.h"

namespace dtsdf {

/// Where a map is stored and computed.
enum class Backend {
  kAuto,  ///< CUDA if there is a usable GPU, otherwise the CPU.
  kCuda,  ///< The current CUDA device; makeMapper() throws if it cannot be used.
  kCpu,   ///< The CPU, on `threads` threads.
};

/// Kind of depth camera, which determines how noise grows with depth. The scale of the noise is
/// estimated from the images.
enum class Sensor {
  kStructuredLight,  ///< Noise is uniform in inverse depth, as with all triangulation: it grows
                     ///< with z^2.
  kStereo,           ///< Noise is uniform in inverse depth, as with kStructuredLight.
  kTimeOfFlight,     ///< Noise is uniform in depth.
};

/// Settings of a mapper. The defaults are those of config/default.yaml.
struct MapperParams {
  Backend backend = Backend::kAuto;          ///< Where the map is stored and computed.
  int threads = 0;                           ///< CPU threads; 0: all cores.
  Sensor sensor = Sensor::kStructuredLight;  ///< Kind of depth camera.
  MapParams map;                             ///< Section "map" of the settings file.
  FusionParams fusion;                       ///< Section "fusion".
  MeshParams mesh;                           ///< Section "mesh".
  SpaceParams space;                         ///< Section "space".
  /// Whether the brightness of colour images is adjusted to that of the map. Set to false if the
  /// exposure and white balance of the camera are locked.
  bool adapt_exposure = true;
  float max_paint_depth_m = 0.0f;  ///< Surfaces at a greater depth are not painted; 0: no limit.
};

/// Visits each member, including those of the sections, with its key and the rule for its value.
/// @relates MapperParams
template <class Visitor>
void visitParams(MapperParams& p, Visitor& visit) {
  visit("backend", p.backend,
        EnumNames<Backend>{
            {"auto", Backend::kAuto}, {"cuda", Backend::kCuda}, {"cpu", Backend::kCpu}});
  visit("threads", p.threads, Range{0, 1024});
  visit("input/sensor", p.sensor,
        EnumNames<Sensor>{{"structured_light", Sensor::kStructuredLight},
                          {"stereo", Sensor::kStereo},
                          {"time_of_flight", Sensor::kTimeOfFlight}});
  visitParams(p.map, visit);
  visitParams(p.fusion, visit);
  visitParams(p.mesh, visit);
  visitParams(p.space, visit);
  visit("colour/exposure", p.adapt_exposure, EnumNames<bool>{{"adaptive", true}, {"fixed", false}});
  visit("colour/max_depth_m", p.max_paint_depth_m, Range{0.0, 1000.0});
}

/// Checks rules that involve several settings. Call this before ParamReader::finish(), which
/// reports violations.
void checkParams(const MapperParams& params, ParamReader& reader);

/// Reads a tree that contains only mapper settings. Missing settings keep their defaults.
/// @throws ParamError with every violation.
MapperParams readMapperParams(const ParamTree& tree);

}  // namespace dtsdf
