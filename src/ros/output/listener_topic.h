/// A topic whose listeners are served one by one: each gets what it lacks as fast as it reads, and
/// what waits for it is known in bytes.
#pragma once

#include <dtsdf_mapping/TopicStatus.h>
#include <ros/advertise_options.h>
#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>
#include <ros/serialized_message.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace dtsdf {

using dtsdf_mapping::TopicStatus;

/// A topic by its name and type. Latched as map_server's are: who comes late gets one, and tools
/// see that.
template <class Message>
ros::AdvertiseOptions topicOf(const std::string& name, bool is_latched = false) {
  ros::AdvertiseOptions options;
  options.init<Message>(name, 1);
  options.latch = is_latched;
  return options;
}

/// A topic that is published to each subscriber by itself.
///
/// A ros::Publisher sends to all alike. roscpp lets nothing but a connect callback publish to one
/// subscriber, and knows who that is only while the callback runs. So the callback that roscpp
/// makes for a connection is kept, and called again for every message to this subscriber. And as
/// that serializes what it publishes, a message that is serialized already goes in as a type whose
/// serialization is the message itself. All that leans on roscpp in this way is in here.
///
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

/// A connection to one subscriber. What was sent is released on roscpp's threads, all else is for
/// one thread.
class ListenerLink {
 public:
  ListenerLink(std::string name, DirectPublisher::Connection connection)
      : name_(std::move(name)), connection_(std::move(connection)) {}

  const std::string& name() const { return name_; }
  const DirectPublisher::Connection& connection() const { return connection_; }

  /// Bytes sent to it that are still in this process.
  size_t waitingBytes() const { return queue_->bytes; }

  /// Whether it has read what was sent to it, and may be sent what is there now: see
  /// ListenerTopic::outdate().
  bool lacksNewest() const { return !has_newest_ && waitingBytes() == 0; }

  /// How long nothing of what waits has been read.
  std::chrono::duration<double> stalledFor() const;

  /// The message as it is to be handed to roscpp: it shares the bytes, and counts as waiting until
  /// roscpp drops it.
  ros::SerializedMessage track(const ros::SerializedMessage& message);

 private:
  friend class ListenerTopic;
  using Clock = std::chrono::steady_clock;

  /// Outlives the link, for as long as roscpp has a message.
  struct Queue {
    std::atomic<size_t> bytes{0};
    std::atomic<Clock::rep> moved{Clock::now().time_since_epoch().count()};
  };

  std::string name_;
  DirectPublisher::Connection connection_;
  bool has_newest_ = false;
  std::shared_ptr<Queue> queue_ = std::make_shared<Queue>();
};

/// A topic whose listeners are served one by one: each gets what it lacks as fast as it reads, and
/// what waits for it is known in bytes.
///
/// A ros::Publisher has queues that count messages and drop the oldest in silence. Here messages
/// are handed over in buffers that report when roscpp lets go of them, and whoever sends looks
/// first.
///
/// One thread only, but for listeners().
class ListenerTopic {
 public:
  using Links = std::vector<std::shared_ptr<ListenerLink>>;

  /// `options` name topic and type.
  ListenerTopic(const ros::NodeHandle& nh, const ros::AdvertiseOptions& options);

  size_t listeners() const { return publisher_.subscribers(); }

  /// Who listens, in the order in which they came.
  const Links& links();

  void send(ListenerLink& link, const ros::SerializedMessage& message);
  /// To all who lack it, if there is one: see outdate().
  void sendNewest(const std::optional<ros::SerializedMessage>& message);

  /// For topics that send all there is in one message: nobody has what is there now, until it is
  /// sent.
  void outdate();

  /// Without what a listener lacks, which the topic does not know.
  TopicStatus report() const;

 private:
  void dropLink(const std::string& name);

  Links links_;
  uint64_t messages_ = 0, bytes_ = 0;
  DirectPublisher publisher_;
};

/// Keeps something for each of the links: what there was for those that are gone goes.
/// @param meet Is called with what a new one has.
template <class Kept, class Meet>
void follow(const ListenerTopic::Links& links, std::map<std::shared_ptr<ListenerLink>, Kept>& kept,
            const Meet& meet) {
  for (auto it = kept.begin(); it != kept.end();) {
    const bool is_here = std::find(links.begin(), links.end(), it->first) != links.end();
    it = is_here ? std::next(it) : kept.erase(it);
  }
  for (const auto& link : links) {
    const auto [entry, is_new] = kept.try_emplace(link);
    if (is_new) meet(entry->second);
  }
}

/// How many bytes may wait for one listener: an equal share of what may wait for all.
struct QueueShare {
  size_t bytes;

  /// Whether another message of about such a size may be sent. One may always be on its way.
  bool hasRoom(const ListenerLink& link, size_t message_bytes) const {
    return link.waitingBytes() == 0 || link.waitingBytes() + message_bytes <= bytes;
  }
};

}  // namespace dtsdf
