/// Entry point for nodelet managers.
#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include <exception>
#include <memory>

#include "ros/common/free_memory.h"
#include "ros/common/node_start.h"
#include "ros/node/pipeline.h"

namespace dtsdf {

class MappingNodelet : public nodelet::Nodelet {
 public:
  ~MappingNodelet() override {
    node_.reset();
    returnFreeMemory();  // the manager keeps running
  }

 private:
  void onInit() override {
    try {
      node_ = startPipeline(getNodeHandle(), getPrivateNodeHandle());
    } catch (const std::exception& error) {
      // The manager reports that the nodelet failed to load, but does not print this text.
      NODELET_FATAL_STREAM(getName() << " cannot start: " << startErrorText(error));
      throw;
    }
  }

  std::shared_ptr<void> node_;
};

}  // namespace dtsdf

PLUGINLIB_EXPORT_CLASS(dtsdf::MappingNodelet, nodelet::Nodelet)
