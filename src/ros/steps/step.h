/// The seam of the node: what a feature adds to the way of a frame, to the output and to the
/// status.
#pragma once

#include <dtsdf_mapping/MapStatus.h>
#include <ros/node_handle.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "page/paged_meshes.h"
#include "params/node_params.h"
#include "ros/common/pace.h"
#include "ros/common/worker_thread.h"
#include "ros/input/frame_queue.h"
#include "ros/input/transforms.h"
#include "ros/steps/mesh_queue.h"

namespace dtsdf {

class LiveMap;
class MapChunks;
class MapFrame;

/// The mesh as it was handed over last. The output's thread holds the mutex while it uses it, and
/// so does who writes it to a file.
struct ShownMesh {
  explicit ShownMesh(const MapParams& params) : meshes(params) {}

  std::mutex mutex;
  PagedMeshes meshes;
  ros::Time stamp;  ///< Stamp of the newest frame in it.
};

/// The rates of the settings, which may change while the node runs.
struct Rates {
  explicit Rates(const NodeParams& params)
      : mesh_hz(params.mesh_rate_hz),
        points_hz(params.points_rate_hz),
        space_hz(params.space_rate_hz) {}

  std::atomic<double> mesh_hz, points_hz, space_hz;
};

/// What steps work with; all of it outlives them.
struct Host {
  const NodeParams& params;
  const Rates& rates;
  Transforms& transforms;
  MapFrame& frame;
  LiveMap& map;
  ShownMesh& mesh;
  WorkerThread& map_loop;
  /// Has the output take over what was handed to it.
  std::function<void()> take_changes;
  /// Waits until the output's thread has taken it over: from then on nothing of an earlier map is
  /// published or answered.
  std::function<void()> await_output;
  std::atomic<bool>& is_ending;  ///< Who waits for something gives up.
};

/// Whose callbacks come where: in the node's private namespace, except `input`.
struct Handles {
  ros::NodeHandle prompt;   ///< On the thread of the node's caller: must not wait.
  ros::NodeHandle waiting;  ///< On threads of services, where they may.
  ros::NodeHandle input;    ///< On the input's thread, in the namespace of the caller.
  std::string ns;           ///< That the node is in, with its input topics; empty for the root.
};

/// One feature. The node has a vector of them: its order is the order of the work.
class Step {
 public:
  virtual ~Step() = default;

  /// Topics and services.
  virtual void advertise(const Handles&) {}
  /// All that is advertised works, and no image has come. @throws what ends the start.
  virtual void begin() {}

  // Map's thread.

  /// Before all other steps: gives a frame the pose that is expected of it, where it has none.
  virtual std::optional<Rejection> expect(PosedFrame&) { return std::nullopt; }
  /// Moves a frame before it is fused or painted, or says why it is not to be.
  virtual std::optional<Rejection> place(PosedFrame&) { return std::nullopt; }
  /// A frame was handed to the mapper; the result says whether it was fused.
  virtual void fused(const PosedFrame&, const IntegrationResult&) {}
  /// How often the mesh is needed as it is now; nothing: it is not.
  virtual std::optional<double> meshRate_hz() const { return std::nullopt; }
  /// An extraction was finished.
  virtual void meshed() {}
  /// A part of the map was emptied.
  virtual void regionCleared(const Region&) {}
  /// A map that was loaded, here without voxels, has taken the place of this one, with its file for
  /// the journal; null: it was emptied.
  virtual void replaced(const MapContents*, const std::shared_ptr<const MapChunks>&) {}
  /// A map of the same frames at corrected poses has taken the place of this one.
  virtual void corrected() {}
  /// The backend has failed.
  virtual void failed() {}
  /// Whether work() would do something.
  enum class Work { kNone, kWhenIdle, kBeforeFrames };
  virtual Work hasWork() const { return Work::kNone; }
  virtual void work() {}

  // Output's thread.

  /// Changes of the mesh were taken over, with the mutex of the mesh held, by whatever thread.
  virtual void changed(const MeshChanges&) {}
  /// Publishes what is due; the mesh is null while a file is written of it. Returns how long
  /// nothing will be due.
  virtual SteadyDuration publish(ShownMesh*) { return SteadyDuration::max(); }

  /// Writes its part of the status, on the thread of the node's caller.
  virtual void fill(dtsdf_mapping::MapStatus&) {}
};

using Steps = std::vector<std::unique_ptr<Step>>;

}  // namespace dtsdf
