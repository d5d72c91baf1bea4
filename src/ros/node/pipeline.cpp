#include "ros/node/pipeline.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <dtsdf_mapping/ClearRegion.h>
#include <dtsdf_mapping/PublishConfig.h>
#include <dynamic_reconfigure/server.h>
#include <ros/console.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ros/common/callback_guard.h"
#include "ros/common/free_memory.h"
#include "ros/common/node_start.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/common/worker_thread.h"
#include "ros/input/image_stream.h"
#include "ros/input/input_status.h"
#include "ros/node/output.h"
#include "ros/steps/live_map.h"
#include "ros/steps/make_steps.h"
#include "ros/steps/map_frame.h"

namespace dtsdf {
namespace {

/// Number of calls and corrected paths that can be served at once: for example, a correction,
/// save_mesh, and a path that replaces a waiting correction.
constexpr int kServiceThreads = 3;
/// Interval at which the transform of a waiting frame is looked up.
constexpr std::chrono::milliseconds kTransformPoll{5};
/// Longest sleep of the input thread; a message wakes it.
constexpr std::chrono::milliseconds kUntilNextImage{1000};

NodeParams readParams(const ros::NodeHandle& private_nh) {
  std::vector<ParamViolation> violations;
  const ParamTree tree = readParamServer(private_nh, violations);
  NodeParams params = readNodeParams(tree, violations);
  std::string& page_folder = params.mapper.map.page_folder;
  page_folder = expandHome(page_folder, "map/page_folder");
  return params;
}

/// The threads are dtsdf_input (messages, poses), dtsdf_map (fusion, mesh), dtsdf_output
/// (publishing), dtsdf_query (planners) and three named dtsdf_service. The status timer, the
/// service pause and the publishing rates are handled on the callback queues of the node handles
/// passed in. A call that waits for a task on another thread rethrows the task's exception, or
/// throws std::future_error once that thread has been stopped.
class Pipeline {
 public:
  Pipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
      : params_(readParams(private_nh)),
        output_loop_("dtsdf_output", kLowNiceness),
        map_loop_("dtsdf_map"),
        services_("dtsdf_service", kLowNiceness),
        queries_("dtsdf_query"),
        input_("dtsdf_input"),
        frame_(params_, transforms_),
        queue_(static_cast<size_t>(params_.input.queue_size),
               static_cast<size_t>(params_.input.queue_mb) << 20, params_.input.merge_wait_s,
               [this] { map_loop_.wake(); }),
        output_(params_, steps_, [this] { output_loop_.wake(); }),
        map_(makeMapper(params_.mapper), params_, queue_, frame_, output_.queue(), steps_),
        host_{params_,
              transforms_,
              frame_,
              map_,
              output_.mesh(),
              map_loop_,
              [this] { output_.takeChanges(); },
              [this] { settle(); },
              is_ending_},
        input_status_(params_.stale_s),
        diagnostics_(nh, private_nh, private_nh.getNamespace()) {
    try {
      start(nh, private_nh);
    } catch (...) {
      stop();
      throw;
    }
  }
  ~Pipeline() { stop(); }

 private:
  void start(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh) {
    const std::string& name = private_nh.getNamespace();
    const Handles handles{
        private_nh,       services_.serve(private_nh), queries_.serve(private_nh),
        input_.serve(nh), map_loop_.serve(nh),         name.substr(0, name.rfind('/'))};
    addStreams(handles.input, handles.ns);
    steps_ = makeSteps(host_);
    for (const auto& step : steps_) step->advertise(handles);
    advertise(handles);
    output_loop_.start([this] { return output_.step(); });
    map_loop_.start([this] { return map_.step(); });
    MapStatus status;
    map_.fill(status);
    ROS_INFO_STREAM_NAMED("dtsdf_mapping", "backend: " << status.backend << ", voxels of "
                                                       << params_.mapper.map.voxel_size_m << " m");
    for (const auto& step : steps_) step->begin();
    transforms_.subscribe(input_.serve(nh));
    for (const auto& stream : streams_) stream->subscribe(private_nh);
    input_.start([this] { return poseFrames(); });
    services_.start(nullptr, kServiceThreads);
    queries_.start(nullptr);
    startStatus(private_nh);
    rates_server_.emplace(ros::NodeHandle(private_nh, "publish"));
    rates_server_->setCallback([this](const dtsdf_mapping::PublishConfig& config, uint32_t) {
      guarded("rates", [&] { setRates(config); });
    });
  }

  /// Each camera of the setting `cameras` has its own namespace; without the setting, a single
  /// camera uses the namespace of the node. If the stamps of a colour stream go back, only that
  /// stream restarts, since geometry does not depend on it.
  void addStreams(const ros::NodeHandle& nh, const std::string& ns) {
    const std::vector<std::string>& names = params_.cameras;
    const auto restart = [this](const ros::Time& stamp) { restartStamps(stamp); };
    for (size_t camera = 0; camera < std::max<size_t>(1, names.size()); ++camera) {
      const std::string name = names.empty() ? "" : names[camera];
      const auto add = [&](const ImageKind& kind, std::function<void(const ros::Time&)> on_jump) {
        streams_.push_back(
            std::make_unique<ImageStream>(kind, name, camera, names.empty() ? ns : ns + "/" + name,
                                          nh, params_, transforms_, queue_, std::move(on_jump)));
      };
      add(kDepthImages, restart);
      if (params_.colour != Usage::kNever) add(kColourImages, nullptr);
    }
  }

  /// Called on the input thread. @return the time until the next call, unless a message arrives.
  std::chrono::milliseconds poseFrames() noexcept {
    bool waits = false;
    guarded("input", [&] {
      for (const auto& stream : streams_) waits = stream->step() || waits;
    });
    return waits ? kTransformPoll : kUntilNextImage;
  }

  void restartStamps(const ros::Time& stamp) {
    for (const auto& stream : streams_) stream->restartStamps(stamp);
    // Under simulated time, Transforms has already cleared itself, and may have received new
    // transforms.
    if (!ros::Time::isSimTime()) transforms_.clear();
  }

  /// Stops all threads. Calls that wait for a task fail, and waiting frames are dropped.
  void stop() {
    rates_server_.reset();
    timer_.stop();
    is_ending_ = true;
    queue_.refuseAll(Rejection{drop::kEnding, "the node is shutting down"});
    map_loop_.stop();
    output_loop_.stop();
    services_.stop();
    queries_.stop();
    input_.stop();
    steps_.clear();
  }

  void advertise(const Handles& handles) {
    servers_.push_back(serve<std_srvs::SetBool>(
        handles.prompt, "pause", [this](const auto& request, auto& response) {
          const Rejection paused{drop::kPaused, "mapping is paused"};
          queue_.refuseAll(request.data ? std::optional<Rejection>(paused) : std::nullopt);
          response.message = request.data ? "paused: frames are dropped" : "mapping";
        }));
    servers_.push_back(
        serve<std_srvs::Trigger>(handles.waiting, "clear_map", [this](const auto&, auto& response) {
          map_loop_.run([this] { map_.clear(); }).get();
          settle();
          returnFreeMemory();
          response.message = "the map is empty";
        }));
    servers_.push_back(serve<dtsdf_mapping::ClearRegion>(
        handles.waiting, "clear_region", [this](const auto& request, auto& response) {
          const Region region =
              readRegion(request.box, request.sphere, frame_.find(request.frame_id));
          const ClearedRegion cleared =
              map_loop_.run([&] { return map_.clearRegion(region); }).get();
          response.voxels = cleared.voxels;
          response.blocks = cleared.blocks;
          response.message = "emptied " + std::to_string(cleared.voxels) + " voxels, freed " +
                             std::to_string(cleared.blocks) + " blocks";
        }));
  }

  /// Waits until the output has applied all changes.
  void settle() {
    output_loop_.run([this] { output_.settle(); }).get();
  }

  void setRates(const dtsdf_mapping::PublishConfig& config) {
    host_.mesh_hz = config.mesh_rate_hz;
    host_.points_hz = config.points_rate_hz;
    host_.space_hz = config.space_rate_hz;
    timer_.setPeriod(ros::WallDuration(1.0 / config.status_rate_hz));
  }

  /// Publishes status and diagnostics at publish/status_rate_hz, in wall time.
  void startStatus(ros::NodeHandle private_nh) {
    diagnostics_.setHardwareID("none");
    diagnostics_.add("mapping", [this](diagnostic_updater::DiagnosticStatusWrapper& diagnostics) {
      diagnostics.summary(status_.level, status_.message);
      diagnostics.add("backend", status_.backend);
      diagnostics.add("images_received", status_.images_received);
      diagnostics.add("frames_fused", status_.frames_fused);
      diagnostics.add("frames_dropped", status_.frames_dropped);
      for (const auto& of : status_.dropped) diagnostics.add("dropped/" + of.reason, of.count);
      diagnostics.add("map_bytes", status_.map_bytes);
    });
    // Latched, so that new subscribers get the last status immediately.
    publisher_ = private_nh.advertise<MapStatus>("status", 1, true);
    publishStatus();  // before the timer starts, because another thread may serve it
    timer_ = private_nh.createWallTimer(
        ros::WallDuration(1.0 / params_.status_rate_hz),
        [this](const ros::WallTimerEvent&) { guarded("status", [this] { publishStatus(); }); });
  }

  void publishStatus() {
    const uint8_t last_code = status_.code;
    fill(status_);
    status_.header.frame_id = frameOfMap(params_);
    status_.header.stamp = ros::Time::now();
    const SteadyTime now = std::chrono::steady_clock::now();
    if (status_.level == MapStatus::OK || status_.code != last_code) {
      problem_since_ = now;
      is_logged_ = false;
    }
    publisher_.publish(status_);
    // Logs each problem once, for users who watch the terminal and not the status.
    constexpr std::chrono::seconds kProblemDelay{5};
    if (!is_logged_ && now - problem_since_ >= kProblemDelay) {
      is_logged_ = true;
      ROS_WARN_STREAM_NAMED("dtsdf_mapping", status_.message);
    }
    diagnostics_.force_update();  // the updater's own timer would wait for simulated time
  }

  void fill(MapStatus& status) {
    std::vector<StreamReport> streams;
    for (const auto& stream : streams_) streams.push_back(stream->report());
    map_.fill(status);
    transforms_.fill(status);
    addMemory(status, "images", kHost, queue_.bytes(), queue_.maxBytes());
    input_status_.fill(streams, queue_.isPaused(), std::chrono::steady_clock::now(),
                       ros::Time::now(), status);
    for (const auto& step : steps_) step->fill(status);
    output_.fill(status);
  }

  const NodeParams params_;
  std::atomic<bool> is_ending_{false};
  WorkerThread output_loop_, map_loop_, services_, queries_, input_;
  Transforms transforms_;
  MapFrame frame_;
  FrameQueue queue_;
  Steps steps_;  ///< Empty until start().
  Output output_;
  LiveMap map_;
  Host host_;
  /// The depth stream of each camera, followed by its colour stream if colour is used.
  std::vector<std::unique_ptr<ImageStream>> streams_;
  InputStatus input_status_;
  std::vector<ros::ServiceServer> servers_;
  MapStatus status_;
  SteadyTime problem_since_;
  bool is_logged_ = false;  ///< Whether the current problem has been logged.
  diagnostic_updater::Updater diagnostics_;
  ros::Publisher publisher_;
  ros::WallTimer timer_;
  /// Its namespace is `publish/`, so that its parameters have the same keys as the settings.
  std::optional<dynamic_reconfigure::Server<dtsdf_mapping::PublishConfig>> rates_server_;
};

}  // namespace

std::shared_ptr<void> startPipeline(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh) {
  return std::make_shared<Pipeline>(nh, private_nh);
}

}  // namespace dtsdf
