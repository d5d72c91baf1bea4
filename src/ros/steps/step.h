/// Interface of the node's features: each may act on frames, publish, and add to the status.
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

/// The mesh that the output thread publishes. Lock the mutex while using the mesh.
struct ShownMesh {
  explicit ShownMesh(const MapParams& params) : meshes(params) {}

  std::mutex mutex;
  PagedMeshes meshes;
  ros::Time stamp;  ///< Stamp of the newest frame in the mesh.
};

/// The parts of the node that steps use; all outlive the steps.
struct Host {
  const NodeParams& params;
  Transforms& transforms;
  MapFrame& frame;
  LiveMap& map;
  ShownMesh& mesh;
  WorkerThread& map_loop;
  /// Applies all queued changes to `mesh`, on the calling thread.
  std::function<void()> take_changes;
  /// Waits until the output thread has applied all queued changes. After that, neither topics nor
  /// answers to queries contain data from an earlier map.
  std::function<void()> await_output;
  std::atomic<bool>& is_ending;  ///< Once set, blocking calls give up.
  /// Rates from the settings. They may change while the node runs.
  std::atomic<double> mesh_hz{params.mesh_rate_hz}, points_hz{params.points_rate_hz},
      space_hz{params.space_rate_hz};
};

/// Node handles for callbacks on different threads; all but `input` and `map` are in the
/// private namespace.
struct Handles {
  ros::NodeHandle prompt;   ///< On the threads of the nodelet manager or node; must not block.
  ros::NodeHandle waiting;  ///< On the service threads; may block.
  ros::NodeHandle query;    ///< On the query thread, for planners; may block.
  ros::NodeHandle input;    ///< On the input thread, in the namespace of the node.
  ros::NodeHandle map;      ///< On the map thread, in the namespace of the node.
  std::string ns;           ///< Namespace of node and input topics; empty for the root.
};

/// One feature of the node. Steps are called in the order in which makeSteps() adds them.
class Step {
 public:
  virtual ~Step() = default;

  /// Advertises topics and services, and subscribes to topics.
  virtual void advertise(const Handles&) {}
  /// Called after all steps have advertised, before the first image. An exception aborts the
  /// startup.
  virtual void begin() {}

  // Called on the map thread, unless stated otherwise.

  /// Sets the expected pose of a frame that has none. Called before place() of any step.
  virtual std::optional<Rejection> expect(PosedFrame&) { return std::nullopt; }
  /// Sets the pose at which a frame is fused or painted, or returns why the frame is dropped.
  virtual std::optional<Rejection> place(PosedFrame&) { return std::nullopt; }
  /// The mapper has processed a frame; the result says whether it was fused.
  virtual void fused(const PosedFrame&, const IntegrationResult&) {}
  /// Rate at which an up-to-date mesh is needed; nullopt if none is needed. Called on any thread.
  virtual std::optional<double> meshRate_hz() const { return std::nullopt; }
  /// A mesh extraction was finished.
  virtual void meshed() {}
  /// A part of the map was emptied.
  virtual void regionCleared(const Region&) {}
  /// A loaded map has replaced the map. The arguments are the loaded contents, without
  /// voxels, and the file; both are null if the map was emptied instead.
  virtual void replaced(const MapContents*, const std::shared_ptr<const MapChunks>&) {}
  /// A map built from the same frames at corrected poses has replaced the map.
  virtual void corrected() {}
  /// The backend has failed.
  virtual void failed() {}
  /// Does some of the step's background work, unless a frame is waiting. @return whether it did
  /// any.
  virtual bool work(bool /*frame_waits*/) { return false; }

  // Called on the output thread, unless stated otherwise.

  /// Changes were applied to the mesh. Called on any thread, with the mutex of the mesh held.
  virtual void changed(const MeshChanges&) {}
  /// Publishes what is due. The mesh is null if it must not be used, for example while another
  /// thread uses it. @return the time until something is due.
  virtual SteadyDuration publish(ShownMesh*) { return SteadyDuration::max(); }

  /// Writes the step's part of the status, on the threads of the nodelet manager or node.
  virtual void fill(dtsdf_mapping::MapStatus&) {}
};

using Steps = std::vector<std::unique_ptr<Step>>;

}  // namespace dtsdf
