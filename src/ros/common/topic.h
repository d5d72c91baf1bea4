/// A published topic that notes new subscribers.
#pragma once

#include <ros/node_handle.h>
#include <ros/single_subscriber_publisher.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace dtsdf {

/// Thread-safe once advertised.
class Topic {
 public:
  /// Publishes to a subscriber that has just connected.
  using OnConnect = std::function<void(const ros::SingleSubscriberPublisher& newcomer)>;

  template <class Message>
  void advertise(ros::NodeHandle nh, const std::string& name, uint32_t queue,
                 OnConnect on_connect = nullptr) {
    publisher_ = nh.advertise<Message>(
        name, queue, [this, on_connect = std::move(on_connect)](const auto& newcomer) {
          if (on_connect) on_connect(newcomer);
          has_new_subscriber_ = true;
        });
  }

  bool hasSubscribers() const { return publisher_.getNumSubscribers() > 0; }
  /// Whether a subscriber has connected since the last call.
  bool takeNewSubscriber() { return has_new_subscriber_.exchange(false); }

  template <class Message>
  void publish(const Message& message) {
    publisher_.publish(message);
  }

 private:
  ros::Publisher publisher_;
  std::atomic<bool> has_new_subscriber_{false};
};

}  // namespace dtsdf
