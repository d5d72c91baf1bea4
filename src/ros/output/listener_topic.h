/// A topic whose listeners are served one by one: each gets what it lacks as fast as it reads, and
/// what waits for it is known in bytes.
///
/// A ros::Publisher sends to all alike, into queues that count messages and drop the oldest in
/// silence. roscpp does let a connect callback publish to its one subscriber. Here that callback is
/// kept, and called again for every message to this subscriber; and messages are handed over in
/// buffers that tell when roscpp lets go of them.
#pragma once

#include <ros/advertise_options.h>
#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>
#include <ros/serialized_message.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace dtsdf {

/// What a topic has sent, for the status.
struct TopicReport {
  std::string topic;
  size_t listeners = 0;
  uint64_t messages = 0, bytes = 0;  ///< Sent so far.
  size_t waiting_bytes = 0;          ///< For listeners that have not read them.
  size_t lacking_chunks = 0;         ///< Of the listener that is farthest behind.
  double stalled_s = 0.0;            ///< Longest time that a listener has left something waiting.
};

/// A connection to one subscriber. What was sent is released on roscpp's threads, all else is for
/// one thread.
class ListenerLink {
 public:
  ListenerLink(std::string name, ros::CallbackInterfacePtr connection)
      : name_(std::move(name)), connection_(std::move(connection)) {}

  const std::string& name() const { return name_; }
  const ros::CallbackInterfacePtr& connection() const { return connection_; }

  /// Bytes sent to it that are still in this process.
  size_t waitingBytes() const { return queue_->bytes; }

  /// How long nothing of what waits has been read.
  std::chrono::duration<double> stalledFor() const;

  /// The message as it is to be handed to roscpp: it shares the bytes, and counts as waiting until
  /// roscpp drops it.
  ros::SerializedMessage track(const ros::SerializedMessage& message);

 private:
  using Clock = std::chrono::steady_clock;

  /// Outlives the link, for as long as roscpp has a message.
  struct Queue {
    std::atomic<size_t> bytes{0};
    std::atomic<Clock::rep> moved{Clock::now().time_since_epoch().count()};
  };

  std::string name_;
  ros::CallbackInterfacePtr connection_;
  std::shared_ptr<Queue> queue_ = std::make_shared<Queue>();
};

/// One thread only, but for listeners().
class ListenerTopic {
 public:
  using Links = std::vector<std::shared_ptr<ListenerLink>>;

  /// `options` name topic and type; queue and callbacks are set here.
  ListenerTopic(ros::NodeHandle nh, ros::AdvertiseOptions options);

  size_t listeners() const { return publisher_.getNumSubscribers(); }

  /// Who listens, in the order in which they came.
  const Links& links();

  void send(ListenerLink& link, const ros::SerializedMessage& message);

  /// Without what a listener lacks, which the topic does not know.
  TopicReport report() const;

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
  void onEnd(const ros::SingleSubscriberPublisher& subscriber);

  Events events_;
  Links links_;
  ros::CallbackInterfacePtr connecting_;        ///< While it is called for the first time.
  const ros::SerializedMessage* outgoing_ = nullptr;  ///< While a link's callback sends it.
  uint64_t messages_ = 0, bytes_ = 0;
  ros::Publisher publisher_;
};

/// How many bytes may wait for one listener: an equal share of what may wait for all.
struct QueueShare {
  size_t bytes;

  /// Whether another message of about such a size may be sent. One may always be on its way.
  bool hasRoom(const ListenerLink& link, size_t message_bytes) const {
    return link.waitingBytes() == 0 || link.waitingBytes() + message_bytes <= bytes;
  }
};

}  // namespace dtsdf
