#include "ros/support/raw_listener.h"

#include <netdb.h>
#include <poll.h>
#include <ros/header.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <sys/socket.h>
#include <unistd.h>
#include <xmlrpcpp/XmlRpc.h>

#include <fstream>
#include <stdexcept>

namespace dtsdf {
namespace {

void expect(bool condition, const char* what) {
  if (!condition) throw std::runtime_error(std::string("raw listener: ") + what);
}

/// Calls a method of a node's XML-RPC interface. Returns only the value, without the status.
XmlRpc::XmlRpcValue callNode(const std::string& node, const char* method,
                             XmlRpc::XmlRpcValue parameters) {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = node;
  expect(ros::master::execute("lookupNode", request, response, uri, false), "no such node");
  std::string host;
  uint32_t port = 0;
  expect(ros::network::splitURI(uri, host, port), "bad URI");
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue result;
  expect(client.execute(method, parameters, result) && static_cast<int>(result[0]) == 1, method);
  return result[2];
}

/// The node that publishes a topic. For a nodelet, this is its manager.
std::string publisherOf(const std::string& topic) {
  XmlRpc::XmlRpcValue request, response, state;
  request[0] = ros::this_node::getName();
  expect(ros::master::execute("getSystemState", request, response, state, false), "no master");
  for (int i = 0; i < state[0].size(); ++i) {
    if (static_cast<std::string>(state[0][i][0]) == topic) return state[0][i][1][0];
  }
  throw std::runtime_error("raw listener: no publisher of " + topic);
}

int connectTo(const std::string& host, int port) {
  addrinfo hints{}, *address = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  expect(getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &address) == 0, "no host");
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  const int failed = connect(descriptor, address->ai_addr, address->ai_addrlen);
  freeaddrinfo(address);
  expect(failed == 0, "connection refused");
  return descriptor;
}

size_t numberIn(const uint8_t* bytes) {
  return bytes[0] | bytes[1] << 8 | bytes[2] << 16 | static_cast<size_t>(bytes[3]) << 24;
}

}  // namespace

RawListener::RawListener(const std::string& topic, const std::string& type,
                         const std::string& md5sum) {
  XmlRpc::XmlRpcValue parameters;
  parameters[0] = "/raw_listener";
  parameters[1] = topic;
  parameters[2][0][0] = "TCPROS";
  XmlRpc::XmlRpcValue protocol = callNode(publisherOf(topic), "requestTopic", parameters);
  socket_ = connectTo(protocol[1], protocol[2]);

  boost::shared_array<uint8_t> fields;
  uint32_t size = 0;
  ros::Header::write(
      {{"callerid", "/raw_listener"}, {"topic", topic}, {"type", type}, {"md5sum", md5sum}}, fields,
      size);
  expect(write(socket_, &size, sizeof(size)) == sizeof(size) &&
             write(socket_, fields.get(), size) == static_cast<ssize_t>(size),
         "header not sent");
  expect(!read(10.0).empty(), "no header came back");
}

RawListener::~RawListener() {
  if (socket_ >= 0) close(socket_);
}

std::vector<uint8_t> RawListener::read(double timeout_s) {
  uint8_t length[4];
  if (!receive(length, sizeof(length), timeout_s)) return {};
  std::vector<uint8_t> message(numberIn(length));
  expect(receive(message.data(), message.size(), 10.0), "incomplete message");
  return message;
}

void RawListener::disconnectAfter(size_t bytes) {
  std::vector<uint8_t> part(bytes);
  expect(receive(part.data(), part.size(), 10.0), "no data received");
  const linger at_once{1, 0};
  setsockopt(socket_, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  close(socket_);
  socket_ = -1;
}

bool RawListener::receive(uint8_t* bytes, size_t count, double timeout_s) {
  while (count > 0) {
    pollfd waiting{socket_, POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(1000.0 * timeout_s)) <= 0) return false;
    const ssize_t got = recv(socket_, bytes, count, 0);
    expect(got > 0, "connection lost");
    bytes += got;
    count -= static_cast<size_t>(got);
  }
  return true;
}

size_t subscribersOf(const std::string& topic) {
  XmlRpc::XmlRpcValue parameters;
  parameters[0] = ros::this_node::getName();
  XmlRpc::XmlRpcValue connections = callNode(publisherOf(topic), "getBusInfo", parameters);
  size_t subscribers = 0;
  for (int i = 0; i < connections.size(); ++i) {
    const std::string direction = connections[i][2], name = connections[i][4];
    if (direction == "o" && name == topic) ++subscribers;
  }
  return subscribers;
}

int publishingProcess(const std::string& topic) {
  XmlRpc::XmlRpcValue parameters;
  parameters[0] = ros::this_node::getName();
  return callNode(publisherOf(topic), "getPid", parameters);
}

size_t residentBytes(int process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/status");
  for (std::string word; file >> word;) {
    size_t kilobytes = 0;
    if (word == "VmRSS:" && file >> kilobytes) return kilobytes << 10;
  }
  throw std::runtime_error("no such process");
}

}  // namespace dtsdf
