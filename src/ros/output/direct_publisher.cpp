#include "ros/output/direct_publisher.h"

#include <ros/single_subscriber_publisher.h>

#include <algorithm>
#include <utility>

namespace dtsdf {
namespace {

/// Makes roscpp take a message that is serialized already, where it would serialize one.
struct ReadyMessage {
  const ros::SerializedMessage& message;
};
ros::SerializedMessage serializeMessage(const ReadyMessage& ready) { return ready.message; }

}  // namespace

void DirectPublisher::Events::addCallback(const ros::CallbackInterfacePtr& callback,
                                          uint64_t owner_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  events_.push_back({callback, owner_id});
}

void DirectPublisher::Events::removeByID(uint64_t owner_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  events_.erase(std::remove_if(events_.begin(), events_.end(),
                               [&](const Event& event) { return event.owner == owner_id; }),
                events_.end());
}

std::vector<ros::CallbackInterfacePtr> DirectPublisher::Events::take() {
  std::vector<ros::CallbackInterfacePtr> callbacks;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Event& event : events_) callbacks.push_back(std::move(event.callback));
  events_.clear();
  return callbacks;
}

DirectPublisher::DirectPublisher(ros::NodeHandle nh, ros::AdvertiseOptions options,
                                 Handlers handlers)
    : handlers_(std::move(handlers)) {
  options.queue_size = 0;  // no limit of roscpp's: who sends looks at what waits
  options.callback_queue = &events_;
  options.connect_cb = [this](const ros::SingleSubscriberPublisher& subscriber) {
    onConnection(subscriber);
  };
  options.disconnect_cb = [this](const ros::SingleSubscriberPublisher& subscriber) {
    handlers_.on_end(subscriber.getSubscriberName());
  };
  publisher_ = nh.advertise(options);
}

void DirectPublisher::poll() {
  outgoing_ = nullptr;  // should a send have ended by an exception
  for (const ros::CallbackInterfacePtr& callback : events_.take()) {
    connecting_ = callback;
    callback->call();
  }
  connecting_.reset();
}

void DirectPublisher::onConnection(const ros::SingleSubscriberPublisher& subscriber) {
  if (outgoing_ != nullptr) {
    subscriber.publish(ReadyMessage{*outgoing_});
  } else {
    handlers_.on_connection(subscriber.getSubscriberName(), connecting_);
  }
}

void DirectPublisher::send(const Connection& connection, const ros::SerializedMessage& message) {
  outgoing_ = &message;
  connection->call();
  outgoing_ = nullptr;
}

}  // namespace dtsdf
