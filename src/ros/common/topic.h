/// A published topic that notes new subscribers and counts its messages for the status.
#pragma once

#include <dtsdf_mapping/TopicStatus.h>
#include <ros/node_handle.h>
#include <ros/serialization.h>
#include <ros/single_subscriber_publisher.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace dtsdf {

/// Thread-safe once advertised, except that only one thread may call publish().
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
    ++messages_;
    bytes_ += ros::serialization::serializationLength(message);
  }

  dtsdf_mapping::TopicStatus status() const {
    dtsdf_mapping::TopicStatus status;
    status.topic = publisher_.getTopic();
    status.listeners = publisher_.getNumSubscribers();
    status.messages = messages_;
    status.bytes = bytes_;
    return status;
  }

 private:
  ros::Publisher publisher_;
  std::atomic<bool> has_new_subscriber_{false};
  std::atomic<uint64_t> messages_{0}, bytes_{0};
};

}  // namespace dtsdf
