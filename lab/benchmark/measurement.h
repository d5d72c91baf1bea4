/// Runs the measurements of `benchmark`: first total times, then times per stage (CPU) or of fusion
/// alone (GPU).
#pragma once

#include <functional>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Times for one frame, and memory in use after it.
struct FrameTime {
  double call_ms = 0.0;   ///< Duration of integrate() alone; a GPU does most of the work later.
  double total_ms = 0.0;  ///< From the call to integrate() until the device has updated the mesh.
  double processor_ms = 0.0;  ///< CPU time of all threads during total_ms.
  double fetch_ms = 0.0;  ///< From the end of total_ms until the changed meshes have been fetched.
  double distances_ms = 0.0;  ///< Update of the distances after fetching; 0 without space/enabled.
  size_t map_bytes = 0;       ///< Size of the map after the frame.
  size_t mapped_bytes = 0;    ///< In a flight: map_bytes plus blocks on disk and dropped blocks.
  bool on_return = false;  ///< Whether the camera is flying back; mapped_bytes is then the value at
                           ///< the same place on the way out.
  size_t resident_bytes = 0;  ///< In a flight: resident memory of the process.
};

struct Measurement {
  std::string backend_name;
  std::vector<FrameTime> frames;  ///< Measured without profiling.
  std::vector<double> fusion_ms;  ///< On a GPU: time per frame, from a separate run without meshes.
  std::vector<Profile> stages;    ///< On a CPU: times per frame, from a separate run.
  MapStats map;
  MapperMemory memory;
  size_t device_bytes = 0;  ///< GPU memory allocated since the mapper was created.
  size_t mesh_bytes = 0;    ///< Vertices and triangles of the whole mesh, on the host.
  size_t triangles = 0;
};

/// Times one frame and the mesh update that follows, which is passed to `use`.
FrameTime timeFrame(ProbedMapper& mapper, const DepthFrame& frame,
                    const std::function<void(const MeshUpdate&)>& use);

/// Measures frames that are already in memory. Each run starts with a new map.
/// @throws std::runtime_error if there are no frames, if a frame cannot be fused, or if the map is
/// full.
Measurement measure(const std::vector<SourceFrame>& frames, const MapperParams& params,
                    const Rules& rules, const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
