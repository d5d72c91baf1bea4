/// The runs of `benchmark`: total times, and then times by stage (CPU) or of fusion alone (GPU).
#pragma once

#include <functional>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Times of one frame, and memory after it.
struct FrameTime {
  double call_ms = 0.0;       ///< integrate() alone; a GPU does most of the work later.
  double total_ms = 0.0;      ///< From the call until the device has updated the mesh.
  double processor_ms = 0.0;  ///< CPU time of all threads within total_ms.
  double fetch_ms = 0.0;      ///< From the end of total_ms until the changed meshes are fetched.
  double distances_ms = 0.0;  ///< Update of distances after fetching; 0 without space.
  size_t map_bytes = 0;       ///< Size of the map after the frame.
  size_t mapped_bytes = 0;    ///< In a flight: map_bytes plus paged and dropped blocks.
  bool on_return = false;  ///< Whether the camera is flying back; mapped_bytes is then the value at
                           ///< this place on the way out.
  size_t resident_bytes = 0;  ///< In a flight: resident memory of the process.
};

struct Measurement {
  std::string backend_name;
  std::vector<FrameTime> frames;  ///< Measured without profiling.
  std::vector<double> fusion_ms;  ///< On a GPU: one per frame, from a separate run without meshes.
  std::vector<Profile> stages;    ///< On a CPU: one per frame, from a separate run.
  MapStats map;
  MapperMemory memory;
  size_t device_bytes = 0;  ///< GPU memory taken since the mapper was created.
  size_t mesh_bytes = 0;    ///< Vertices and triangles of the whole mesh, on the host.
  size_t triangles = 0;
};

/// Times one frame and the mesh update after it, which is passed to `use`.
FrameTime timeFrame(ProbedMapper& mapper, const DepthFrame& frame,
                    const std::function<void(const MeshUpdate&)>& use);

/// Measures frames that are already in memory. Each run has its own map.
/// @throws std::runtime_error if there are no frames, one cannot be fused, or the map is full.
Measurement measure(const std::vector<SourceFrame>& frames, const MapperParams& params,
                    const Rules& rules, const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
