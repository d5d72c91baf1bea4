/// The node's services, by their names, and the one way in which they answer.
#pragma once

#include <dtsdf_mapping/ClearRegion.h>
#include <dtsdf_mapping/CorrectPoses.h>
#include <dtsdf_mapping/GetDistances.h>
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <dtsdf_mapping/SaveMesh.h>
#include <dtsdf_mapping/SaveTrajectory.h>
#include <dtsdf_mapping/SetPose.h>
#include <ros/console.h>
#include <ros/node_handle.h>

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "params/printable.h"
#include "ros/common/worker_thread.h"
#include "ros/session/mapping_pipeline.h"

namespace dtsdf {

// The one way in which services answer: what was done or why it was not, in words that may stand
// in a log, whatever the names from outside in them.

/// Has `work` fill the answer, but for success and with a message of what was done; where it throws
/// the answer says why, and nothing else. Either goes to the log, failures every five seconds at
/// most.
template <class Response, class Work>
void answer(const std::string& service, Response& response, const Work& work) {
  std::string problem = "unknown error";
  try {
    work();
    response.success = true;
    response.message = printableMessage(response.message);
    if (response.message.empty()) return;
    ROS_INFO_STREAM_NAMED("dtsdf_mapping", service << ": " << response.message);
    return;
  } catch (const std::exception& error) {
    problem = errorText(error);
  } catch (...) {  // what leaves a callback ends every nodelet of the process
  }
  response = Response();
  response.success = false;
  response.message = problem;
  ROS_WARN_STREAM_THROTTLE_NAMED(5.0, "dtsdf_mapping", service << ": " << problem);
}

/// What a service does: fills the answer, or throws.
template <class Service>
using ServiceWork =
    std::function<void(const typename Service::Request&, typename Service::Response&)>;

/// Advertises a service that is answered by answer().
template <class Service>
ros::ServiceServer advertise(ros::NodeHandle nh, const std::string& name,
                             ServiceWork<Service> work) {
  using Request = typename Service::Request;
  using Response = typename Service::Response;
  const boost::function<bool(Request&, Response&)> callback =
      [name, work = std::move(work)](Request& request, Response& response) {
        answer(name, response, [&] { work(request, response); });
        return true;
      };
  return nh.advertiseService<Request, Response>(name, callback);
}

/// Those that wait for a loop of the pipeline have threads of their own.
class MapServices {
 public:
  /// The pipeline outlives it.
  MapServices(const ros::NodeHandle& private_nh, MappingPipeline& pipeline);

  /// Whoever waits for the pipeline is served before this returns.
  ~MapServices();

  /// Calls are answered from now on.
  void start();

  /// The full name of one.
  std::string nameOfOne() const { return servers_.back().getService(); }

 private:
  using MapFileWork = MapFiles::Done (MappingPipeline::*)(const std::string& path);

  void advertiseFiles(const ros::NodeHandle& nh);
  void advertiseMap(const ros::NodeHandle& nh);
  void saveMesh(const dtsdf_mapping::SaveMesh::Request& request,
                dtsdf_mapping::SaveMesh::Response& response);
  template <class Request, class Response>
  void withMapFile(const Request& request, Response& response, MapFileWork work);
  void saveTrajectory(const dtsdf_mapping::SaveTrajectory::Request& request,
                      dtsdf_mapping::SaveTrajectory::Response& response);
  void clearRegion(const dtsdf_mapping::ClearRegion::Request& request,
                   dtsdf_mapping::ClearRegion::Response& response);
  void correctPoses(const dtsdf_mapping::CorrectPoses::Request& request,
                    dtsdf_mapping::CorrectPoses::Response& response);
  void getDistances(const dtsdf_mapping::GetDistances::Request& request,
                    dtsdf_mapping::GetDistances::Response& response);
  std::string outputPath(const std::string& file_name,
                         const std::vector<std::string>& extensions) const;

  MappingPipeline& pipeline_;
  CallbackThread save_thread_{2}, clear_thread_, query_thread_, correct_thread_{2};
  std::atomic<bool> is_ending_{false};
  std::mutex saving_;               ///< What saves or loads goes one after the other,
  uint64_t turn_ = 0;               ///< by the number that it came with,
  std::atomic<uint64_t> saves_{0};  ///< and knows by the newest one that another waits.
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace dtsdf
