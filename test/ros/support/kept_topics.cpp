#include "ros/support/kept_topics.h"

#include <map>

namespace dtsdf {
namespace {

std::map<std::string, ros::Publisher>& keptTopics() {
  static std::map<std::string, ros::Publisher> topics;
  return topics;
}

}  // namespace

ros::Publisher keepTopic(const ros::Publisher& publisher) {
  return keptTopics().insert({publisher.getTopic(), publisher}).first->second;
}

void releaseKeptTopics() { keptTopics().clear(); }

}  // namespace dtsdf
