/// A subscriber that connects like roscpp but reads messages only on demand.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dtsdf {

class RawListener {
 public:
  /// Connects to the publisher of a topic.
  /// @throws std::runtime_error if that fails.
  RawListener(const std::string& topic, const std::string& type, const std::string& md5sum);
  ~RawListener();
  RawListener(const RawListener&) = delete;
  RawListener& operator=(const RawListener&) = delete;

  /// Returns the next serialised message, or nothing on timeout.
  std::vector<uint8_t> read(double timeout_s);

  /// Returns the next message, or nothing on timeout.
  template <class Message>
  std::optional<Message> readMessage(double timeout_s) {
    std::vector<uint8_t> bytes = read(timeout_s);
    if (bytes.empty()) return std::nullopt;
    Message message;
    ros::serialization::IStream stream(bytes.data(), static_cast<uint32_t>(bytes.size()));
    ros::serialization::deserialize(stream, message);
    return message;
  }

  /// Reads this many bytes, then disconnects like a killed process: undelivered data is discarded.
  /// Nothing can be read afterwards.
  void disconnectAfter(size_t bytes);

 private:
  bool receive(uint8_t* bytes, size_t count, double timeout_s);

  int socket_ = -1;
};

template <class Message>
RawListener listenRaw(const std::string& topic) {
  namespace traits = ros::message_traits;
  return {topic, traits::datatype<Message>(), traits::md5sum<Message>()};
}

/// Number of connections to subscribers of a topic, according to its publisher.
size_t subscribersOf(const std::string& topic);

/// ID of the process that publishes a topic.
int publishingProcess(const std::string& topic);

/// Resident memory of a process, in bytes (VmRSS).
size_t residentBytes(int process);

}  // namespace dtsdf
