/// A topic that is published to each subscriber by itself.
///
/// A ros::Publisher sends to all alike. roscpp lets nothing but a connect callback publish to one
/// subscriber, and knows who that is only while the callback runs. So the callback that roscpp
/// makes for a connection is kept, and called again for every message to this subscriber. And as
/// that serializes what it publishes, a message that is serialized already goes in as a type whose
/// serialization is the message itself. All that leans on roscpp in this way is in here.
#pragma once

#include <ros/advertise_options.h>
#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>
#include <ros/serialized_message.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace dtsdf {

/// One thread only, but for subscribers().
class DirectPublisher {
 public:
  /// To one subscriber.
  using Connection = ros::CallbackInterfacePtr;

  /// Called by poll(). A connection that has ended is known by its subscriber's name only.
  struct Handlers {
    std::function<void(const std::string& subscriber, const Connection& connection)> on_connection;
    std::function<void(const std::string& subscriber)> on_end;
  };

  /// `options` name topic and type; queue and callbacks are set here.
  DirectPublisher(ros::NodeHandle nh, ros::AdvertiseOptions options, Handlers handlers);

  size_t subscribers() const { return publisher_.getNumSubscribers(); }
  std::string topic() const { return publisher_.getTopic(); }

  /// Handles the connections that began or ended since the last call.
  void poll();

  /// @pre The connection has not ended.
  void send(const Connection& connection, const ros::SerializedMessage& message);

 private:
  /// Keeps roscpp's callbacks, from any thread, until they are taken.
  class Events : public ros::CallbackQueueInterface {
   public:
    void addCallback(const ros::CallbackInterfacePtr& callback, uint64_t owner_id) override;
    void removeByID(uint64_t owner_id) override;
    std::vector<ros::CallbackInterfacePtr> take();

   private:
    struct Event {
      ros::CallbackInterfacePtr callback;
      uint64_t owner;
    };
    std::mutex mutex_;
    std::vector<Event> events_;
  };

  void onConnection(const ros::SingleSubscriberPublisher& subscriber);

  const Handlers handlers_;
  Events events_;
  Connection connecting_;                             ///< While it is called for the first time.
  const ros::SerializedMessage* outgoing_ = nullptr;  ///< While a connection's callback sends it.
  ros::Publisher publisher_;
};

}  // namespace dtsdf
