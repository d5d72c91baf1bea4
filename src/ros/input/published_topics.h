/// Which topics there are that images may come from, for those who wait for another one.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

/// Sorted, each once.
struct PublishedTopics {
  /// Images with "depth" in their name; compressed ones by the name of their image.
  std::vector<std::string> depth;
  std::vector<std::string> only_compressed;  ///< Those of them that have no images as they are.
  std::vector<std::string> colour;  ///< The same with "color", "colour" or "rgb", and not "depth".
  std::vector<std::string> camera_info;  ///< Without those of views of maps.
};

/// Asks the master, and waits for it no longer than for its answer; empty without one.
PublishedTopics findPublishedTopics();

/// "'/a' and '/b'".
std::string inQuotes(const std::vector<std::string>& topics);

}  // namespace dtsdf
