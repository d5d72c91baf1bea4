#include "ros/output/listener_topic.h"

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

std::chrono::duration<double> ListenerLink::stalledFor() const {
  if (queue_->bytes == 0) return std::chrono::duration<double>(0.0);
  return Clock::now() - Clock::time_point(Clock::duration(queue_->moved));
}

ros::SerializedMessage ListenerLink::track(const ros::SerializedMessage& message) {
  if (queue_->bytes == 0) queue_->moved = Clock::now().time_since_epoch().count();
  queue_->bytes += message.num_bytes;
  const auto release = [queue = queue_, buffer = message.buf, size = message.num_bytes](uint8_t*) {
    queue->bytes -= size;
    queue->moved = Clock::now().time_since_epoch().count();
  };
  ros::SerializedMessage tracked = message;
  tracked.buf = boost::shared_array<uint8_t>(message.buf.get(), release);
  return tracked;
}

ListenerTopic::ListenerTopic(const ros::NodeHandle& nh, const ros::AdvertiseOptions& options)
    : publisher_(nh, options,
                 {[this](const std::string& name, const DirectPublisher::Connection& connection) {
                    links_.push_back(std::make_shared<ListenerLink>(name, connection));
                  },
                  [this](const std::string& name) { dropLink(name); }}) {}

const ListenerTopic::Links& ListenerTopic::links() {
  publisher_.poll();
  return links_;
}

/// A node has one connection; where it has started anew before its old one was found dead, that one
/// ends first.
void ListenerTopic::dropLink(const std::string& name) {
  const auto ended = std::find_if(links_.begin(), links_.end(),
                                  [&](const auto& link) { return link->name() == name; });
  if (ended != links_.end()) links_.erase(ended);
}

void ListenerTopic::send(ListenerLink& link, const ros::SerializedMessage& message) {
  publisher_.send(link.connection(), link.track(message));
  link.has_newest_ = true;
  ++messages_;
  bytes_ += message.num_bytes;
}

void ListenerTopic::sendNewest(const std::optional<ros::SerializedMessage>& message) {
  for (const auto& link : links()) {
    if (message && link->lacksNewest()) send(*link, *message);
  }
}

void ListenerTopic::outdate() {
  for (const auto& link : links_) link->has_newest_ = false;
}

TopicStatus ListenerTopic::report() const {
  TopicStatus report;
  report.topic = publisher_.topic();
  report.listeners = static_cast<uint32_t>(links_.size());
  report.messages = messages_;
  report.bytes = bytes_;
  for (const auto& link : links_) {
    report.waiting_bytes += link->waitingBytes();
    report.stalled_s = std::max(report.stalled_s, static_cast<float>(link->stalledFor().count()));
  }
  return report;
}

}  // namespace dtsdf
