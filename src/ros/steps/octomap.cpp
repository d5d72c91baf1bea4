/// The step that publishes free and occupied cells as an OctoMap while someone listens. Compiled
/// only if octomap_msgs is installed.
#include <octomap_msgs/Octomap.h>

#include <locale>
#include <memory>
#include <sstream>

#include "planning/oc_tree.h"
#include "ros/common/callback_guard.h"
#include "ros/steps/make_steps.h"
#include "ros/steps/space.h"

namespace dtsdf {
namespace {

class OctomapStep : public Step {
 public:
  OctomapStep(const Host& host, const SpaceStep& space)
      : host_(host), space_(space), pace_(host.space_hz) {}

  void advertise(const Handles& handles) override {
    topic_.advertise<octomap_msgs::Octomap>(handles.prompt, "octomap", 1);
  }

  /// Returns max(), because SpaceStep already makes the output thread call all steps every 50 ms.
  SteadyDuration publish(ShownMesh*) override {
    const SteadyTime begin = std::chrono::steady_clock::now();
    const SpaceStep::Known known = space_.known();
    const SpaceSnapshot& space = *known.space;
    pace_.setRate(host_.space_hz, begin);
    if (topic_.takeNewSubscriber()) published_.reset();
    const bool has_space = space.cellSize_m() > 0.0;  // stays true after clear_map
    const bool is_outdated = known.space != published_.lock();
    if (!has_space || !is_outdated || !topic_.hasSubscribers() || !pace_.isDue(begin)) {
      return SteadyDuration::max();
    }
    published_ = known.space;
    guarded("octomap", [&] { topic_.publish(makeMessage(space, known.stamp)); });
    pace_.end(begin);
    return SteadyDuration::max();
  }

 private:
  /// Builds the message that octomap_msgs::binaryMapToMsg() would build.
  octomap_msgs::Octomap makeMessage(const SpaceSnapshot& space, const ros::Time& stamp) const {
    octomap::OcTree tree(space.cellSize_m());
    space.visitCubes([&](const std::vector<SpaceCube>& cubes) {
      for (const SpaceCube& cube : cubes) {
        for (int i = 0; i < SpaceCube::kSide * 64; ++i) {
          const Vec3i cell = cube.cellOf(i / 64, i % 64);
          const CellState state = cube.stateOf(cell);
          if (state != CellState::kUnknown) addToTree({cell, state}, tree);
        }
      }
    });
    tree.updateInnerOccupancy();
    tree.prune();
    std::ostringstream bytes;
    bytes.imbue(std::locale::classic());
    tree.writeBinaryData(bytes);
    const std::string data = bytes.str();
    octomap_msgs::Octomap message;
    message.header.frame_id = frameOfMap(host_.params);
    message.header.stamp = stamp;
    message.binary = true;
    message.id = tree.getTreeType();
    message.resolution = tree.getResolution();
    message.data.assign(data.begin(), data.end());
    return message;
  }

  const Host& host_;
  const SpaceStep& space_;
  std::weak_ptr<const SpaceSnapshot> published_;
  Pace pace_;
  Topic topic_;
};

}  // namespace

std::unique_ptr<Step> makeOctomapStep(const Host& host, const SpaceStep& space) {
  return std::make_unique<OctomapStep>(host, space);
}

}  // namespace dtsdf
