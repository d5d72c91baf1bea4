/// What the frame log holds, and its bytes.
///
/// A segment file is a sequence of records: 48 bytes of head, then what describes the record, then
/// its pixels. All numbers are little-endian. The head: magic "DLR1", kind, number (8 bytes), bytes
/// of the description (4), 0 (4), bytes of the pixels (8), XXH64 of the pixels, XXH64 of the head
/// so far and the description.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/params/param_set.h"
#include "dtsdf_mapping/params/pose_params.h"
#include "dtsdf_mapping/region.h"
#include "io/trajectory.h"

namespace dtsdf {

/// The numbers are those of the files.
enum class LogKind : uint32_t {
  kBegin = 1,        ///< The map that what follows goes into, and its settings.
  kDepth = 2,        ///< A depth image that was handed to the mapper.
  kColour = 3,       ///< A colour image that was.
  kClearRegion = 4,  ///< A part of the map was emptied.
  kLevel = 5,        ///< The map's place in the frame that poses are given in.
  kCorrection = 6,   ///< Poses of images before it were corrected.
};

constexpr size_t kLogHeadBytes = 48;
/// More than a description has: a correction with millions of poses.
constexpr uint32_t kMostDescriptionBytes = 1u << 30;

struct LogHead {
  LogKind kind = LogKind::kBegin;
  uint64_t number = 0;  ///< One higher than that of the record before.
  uint32_t description_bytes = 0;
  uint64_t pixel_bytes = 0;
  uint64_t pixel_hash = 0;
};

/// A whole record, but for the number that it gets in its file.
struct LogRecord {
  LogKind kind = LogKind::kBegin;
  std::string description;
  std::string pixels;  ///< Coded.
};

/// Head and description, ready to be written. The pixels follow as they are.
std::string encodeRecord(const LogRecord& record, uint64_t number);

/// Nothing, if these bytes are not the head of a record. Its checksum is not looked at.
std::optional<LogHead> decodeHead(const uint8_t* bytes);

/// Whether head and description are as they were written. @pre There are so many bytes.
bool isWhole(const uint8_t* head, const LogHead& decoded, const std::string& description);

/// Whether the pixels are.
bool isWhole(const LogHead& head, const std::string& pixels);

/// What kBegin holds.
struct LogBegin {
  ParamTree settings;            ///< Of the mapper.
  PoseParams poses;              ///< How the poses of its images were found.
  std::string map_frame;         ///< Name of the frame that poses are of.
  bool has_map = false;          ///< It begins with a map, in a file of its own; else it is empty.
  bool continues = false;        ///< That is the map which the records before have led to.
  bool stands_for_lost = false;  ///< It is what images that were not logged have led to.
  double stamp_s = 0.0;          ///< Of the newest image in the map.
};

/// What all images have.
struct LogImage {
  double stamp_s = 0.0;
  uint32_t camera = 0;  ///< Its place among the cameras.
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
};

/// What kCorrection holds.
struct LogCorrection {
  uint64_t before = 0;             ///< Images with a smaller number were fused when it came.
  uint64_t first_moved = 0;        ///< The first image that it moves.
  std::vector<StampedPose> poses;  ///< Of the first camera.
};

// The records of each kind. Images are packed, with their pixels.
LogRecord toRecord(const LogBegin& begin);
LogRecord toRecord(const DepthFrame& frame, double stamp_s, uint32_t camera);
LogRecord toRecord(const ColourFrame& frame, double stamp_s, uint32_t camera);
LogRecord toRecord(const Region& region);
LogRecord levelRecord(const Eigen::Isometry3d& T_W_M);
LogRecord toRecord(const LogCorrection& correction);

/// A depth image with what its pixels live in.
struct LoggedDepth {
  LogImage image;
  DepthFrame frame;  ///< Its `data` points into one of these.
  std::vector<uint16_t> integers;
  std::vector<float> floats;
};

/// A colour image with what its pixels live in.
struct LoggedColour {
  LogImage image;
  ColourFrame frame;
  std::vector<uint8_t> bytes;
};

// And back. Each throws std::runtime_error for what is not such a record.
LogBegin readBegin(const std::string& description);
LogImage readImage(LogKind kind, const std::string& description);  ///< Without the pixels.
LoggedDepth readDepth(const LogRecord& record);
LoggedColour readColour(const LogRecord& record);
Region readRegion(const std::string& description);
Eigen::Isometry3d readLevel(const std::string& description);
LogCorrection readCorrection(const std::string& description);

}  // namespace dtsdf
