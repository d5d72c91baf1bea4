/// Whether the ROS master still knows this node.
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace dtsdf {

/// A master that was restarted has forgotten all nodes, and roscpp does not register again: who is
/// connected stays so, but nobody else finds the node, neither its topics nor its services. Asks
/// every few seconds, on a thread of its own, as a master that hangs may answer late.
class MasterWatch {
 public:
  /// `service` is one of the node's own, which the master has to know.
  explicit MasterWatch(std::string service, double period_s = 3.0);
  ~MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;

  /// What is wrong, and what to do; empty if nothing is.
  std::string problem() const;

 private:
  void run();
  std::string ask() const;

  const std::string service_;
  const double period_s_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable stop_;
  bool stopping_ = false;
  std::string problem_;
  std::thread thread_;
};

}  // namespace dtsdf
