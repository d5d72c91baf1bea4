/// Whether the ROS master still knows this node.
#pragma once

#include <mutex>
#include <string>

#include "ros/common/worker_thread.h"

namespace dtsdf {

/// A master that was restarted has forgotten all nodes, and roscpp does not register again: who is
/// connected stays so, but nobody else finds the node, neither its topics nor its services. Asks
/// every few seconds, on a thread of its own, as a master that hangs may answer late.
class MasterWatch {
 public:
  /// `service` is one of the node's own, which the master has to know.
  explicit MasterWatch(std::string service);

  /// What is wrong, and what to do; empty if nothing is.
  std::string problem() const;

 private:
  void look();
  std::string ask() const;

  const std::string service_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::string problem_;
  WorkerThread thread_;
};

}  // namespace dtsdf
