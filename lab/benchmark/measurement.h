/// The runs of `benchmark`: what a frame takes in all, and by stages.
#pragma once

#include <functional>
#include <vector>

#include "dtsdf_mapping/io/frame_source.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// Wall time of one frame, with nothing else going on.
struct FrameTime {
  double call_ms = 0.0;   ///< integrate() alone; on a GPU most of the work is still to come then.
  double total_ms = 0.0;  ///< From the call until the updated mesh is made, on the device.
  double processor_ms = 0.0;  ///< Time of all threads in total_ms, waits for the device included.
  double fetch_ms = 0.0;      ///< From there until the changed meshes are handed out.
  double distances_ms = 0.0;  ///< To bring distances of space up to date after that; 0: no space.
  size_t map_bytes = 0;       ///< Size of the map after the frame.
  size_t mapped_bytes = 0;    ///< In a flight, with what was mapped and dropped by then.
  bool on_return = false;     ///< In a flight, mapped_bytes are those of the way out at its place.
  size_t resident_bytes = 0;  ///< In a flight, memory of the process after the frame.
};

struct Measurement {
  std::string backend_name;
  std::vector<FrameTime> frames;  ///< Without a profile.
  std::vector<Profile> stages;    ///< One per frame, from a run of its own.
  MapStats map;
  std::vector<MemoryPart> memory;
  size_t device_bytes = 0;  ///< Taken from the GPU from the mapper's making to the last frame.
  size_t mesh_bytes = 0;    ///< The whole mesh by blocks, on the host.
  size_t triangles = 0;
};

/// Times one frame and the mesh update after it; the update is given to `use`.
FrameTime timeFrame(ProbedMapper& mapper, const DepthFrame& frame,
                    const std::function<void(const MeshUpdate&)>& use);

/// Measures with frames that lie in memory, with a mesh update after each. Each run has a map of
/// its own. @throws std::runtime_error if a frame cannot be fused.
Measurement measure(const std::vector<SourceFrame>& frames, const MapperParams& params,
                    const Rules& rules, const std::function<void(size_t)>& show_progress);

}  // namespace dtsdf
