/// The runs of `benchmark`: a frame's total time, and its time by stages.
#pragma once

#include <functional>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Wall time of one frame, with nothing else going on.
struct FrameTime {
  double call_ms = 0.0;       ///< integrate() alone; a GPU does most of the work later.
  double total_ms = 0.0;      ///< From the call until the device has updated the mesh.
  double processor_ms = 0.0;  ///< CPU time of all threads in total_ms, including waits for the
                              ///< device.
  double fetch_ms = 0.0;      ///< From then until the changed meshes are fetched.
  double distances_ms = 0.0;  ///< Update of the distances after that; 0: no space.
  size_t map_bytes = 0;       ///< Size of the map after the frame.
  size_t mapped_bytes = 0;    ///< In a flight: including dropped and paged blocks.
  bool on_return = false;     ///< In a flight: mapped_bytes is that of the way out at this place.
  size_t resident_bytes = 0;  ///< In a flight: memory of the process after the frame.
};

struct Measurement {
  std::string backend_name;
  std::vector<FrameTime> frames;  ///< Without a profile.
  std::vector<double> fusion_ms;  ///< On a GPU: of a separate run without meshes.
  std::vector<Profile> stages;    ///< On a CPU: one per frame, from a separate run.
  MapStats map;
  MapperMemory memory;
  size_t device_bytes = 0;  ///< GPU memory taken since the mapper was created.
  size_t mesh_bytes = 0;    ///< The whole mesh by blocks, on the host.
  size_t triangles = 0;
};

/// Times one frame and the mesh update after it, which is passed to `use`.
FrameTime timeFrame(ProbedMapper& mapper, const DepthFrame& frame,
                    const std::function<void(const MeshUpdate&)>& use);

/// Measures frames that are in memory, with a mesh update after each. Each run has its own map.
/// @throws std::runtime_error if a frame cannot be fused.
Measurement measure(const std::vector<SourceFrame>& frames, const MapperParams& params,
                    const Rules& rules, const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
