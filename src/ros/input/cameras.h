/// All cameras of the node, in one order of stamps, and the streams of images that each has.
#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/rate_limit.h"
#include "ros/input/camera_input.h"
#include "ros/input/frame_accounting.h"
#include "ros/input/frame_intake.h"

namespace dtsdf {

/// One kind of a camera's images: its topics, its frames on their way to the map, and what became
/// of them.
class ImageStream {
 public:
  /// Of topics in `ns` (see CameraInput for why). `on_frame` reports that something waits for the
  /// intake's thread.
  ImageStream(const std::string& ns, const ros::NodeHandle& nh, const InputParams& params,
              ImageKind kind, const FrameIntake::Parts& parts, std::function<void()> on_frame);

  /// Begins and ends to receive; the latter waits for nobody.
  void subscribe(const ros::NodeHandle& private_nh);
  void unsubscribe() { input_.reset(); }

  /// Where its frames wait.
  FrameIntake& intake() { return intake_; }

  /// While subscribed.
  StreamReport report() const;

 private:
  void onFrame(const FrameMessages& frame);
  void makeRoom();

  std::string ns_;
  ros::NodeHandle nh_;
  InputParams params_;
  const ImageKind kind_;
  std::function<void()> on_frame_;
  RateLimit rate_limit_;  ///< Callbacks' thread only.
  FrameAccounting& accounting_;
  FrameIntake intake_;
  std::unique_ptr<CameraInput> input_;
};

/// The namespace that the node is in, and the topics that it reads; empty for the root.
std::string namespaceOf(const ros::NodeHandle& private_nh);

/// Each camera of the setting `cameras` has its topics in its namespace; without that setting there
/// is one camera in the node's own. A camera is a stream of depth, and one of colour where that is
/// wanted. Callbacks come on one thread at a time.
class Cameras {
 public:
  /// What the cameras work with; all of it outlives them.
  struct Parts {
    PoseSource& poses;
    FrameQueue& posed_frames;
    FrameLedger& ledger;
    std::function<void()> on_frame;  ///< Something waits for step().
  };

  Cameras(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh, const NodeParams& params,
          Parts parts);

  /// Begins and ends to receive; the latter waits for nobody.
  void subscribe(const ros::NodeHandle& private_nh);
  void unsubscribe();

  /// Intake's thread: see FrameIntake::step().
  std::chrono::milliseconds step() noexcept;

  /// Intake's thread: see FrameIntake::restartMotion().
  void restartMotion();

  /// See FrameIntake::setPaused().
  void setPaused(bool paused);
  bool paused() const { return cameras_.front().depth->intake().paused(); }

  /// In the order of the setting; while subscribed.
  std::vector<CameraReport> report() const;

 private:
  struct Camera {
    std::string name;  ///< Empty for the only one.
    std::unique_ptr<ImageStream> depth;
    std::unique_ptr<ImageStream> colour;  ///< Null where none is wanted.
  };

  void add(const std::string& name, const std::string& ns, const ros::NodeHandle& nh,
           const NodeParams& params);
  std::unique_ptr<ImageStream> makeDepth(const std::string& name, const std::string& ns,
                                         const ros::NodeHandle& nh, const NodeParams& params);
  std::unique_ptr<ImageStream> makeColour(const std::string& name, const std::string& ns,
                                          const ros::NodeHandle& nh, const NodeParams& params);
  template <class Visit>
  void visitStreams(const Visit& visit) const;
  void restartStamps();

  Parts parts_;
  bool is_colour_needed_;
  std::vector<Camera> cameras_;  ///< At least one.
};

}  // namespace dtsdf
