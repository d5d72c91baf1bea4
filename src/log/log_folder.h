/// Where the frame log has its files: FOLDER/000001/0001.frames, one folder for each stretch that
/// begins with a map of its own (base.dtsdf) or with an empty one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

constexpr char kLogSegmentExtension[] = ".frames";

/// A folder of a stretch.
struct LogStretchFolder {
  std::string path;
  uint64_t index = 0;  ///< Of its name.
};

/// Those of a log in rising order; empty if there is none.
std::vector<LogStretchFolder> stretchesIn(const std::string& folder);

/// The segment files of a stretch in rising order.
std::vector<std::string> segmentsIn(const std::string& stretch);

/// The file of the map that a stretch begins with.
std::string baseMapOf(const std::string& stretch);

/// Names of what comes next.
std::string stretchName(const std::string& folder, uint64_t index);
std::string segmentName(const std::string& stretch, uint64_t index);

/// A map that waits to become the first of a stretch, and those that a process that ended has left.
std::string waitingMapName(const std::string& folder, uint64_t index);
std::vector<std::string> waitingMapsIn(const std::string& folder);

/// Whether a folder holds a frame log.
bool isFrameLog(const std::string& folder);

/// Bytes of the files in a stretch.
uint64_t bytesIn(const std::string& stretch);

/// Removes a stretch; what cannot be removed stays.
void removeStretch(const std::string& stretch) noexcept;

}  // namespace dtsdf
