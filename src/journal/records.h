/// What a journal holds, and its records: docs/map_format.md describes them byte by byte.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/params/param_set.h"
#include "dtsdf_mapping/params/pose_params.h"
#include "dtsdf_mapping/region.h"
#include "io/records.h"
#include "io/trajectory.h"

namespace dtsdf {
namespace journal {

/// What the head of a journal says that it is, and how its files are called.
constexpr char kPurpose[] = "JRNL", kExtension[] = ".dtsdfj";

/// Kinds of records; those of a map may follow kBegin.
constexpr char kBegin[] = "BEGN", kDepth[] = "DIMG", kColour[] = "CIMG", kPixels[] = "PIXL",
               kClear[] = "CLRG", kLevel[] = "TWM ", kCorrection[] = "CORR";

/// The map that what follows goes into.
struct Begin {
  ParamTree settings;       ///< Of the mapper.
  PoseParams poses;         ///< How the poses of images were found.
  std::string map_frame;    ///< Name of the frame that poses are given in.
  std::string level_frame;  ///< Name of the frame that the map is in; the same unless levelled.
  bool has_map = false;     ///< Its records follow; else it is empty.
};

/// What all images have.
struct Image {
  double stamp_s = 0.0;
  uint32_t camera = 0;                                      ///< Its place among the cameras.
  Eigen::Isometry3d T_W_G = Eigen::Isometry3d::Identity();  ///< Pose as it was given.
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();  ///< Pose that it was fused at.
};

/// Poses of the first camera's images that were corrected.
struct Correction {
  uint64_t before = 0;  ///< Records since kBegin when it came: only those were fused by then.
  std::vector<StampedPose> poses;
};

/// A depth or colour image with what its pixels live in.
struct StoredDepth {
  Image image;
  DepthFrame frame;
  std::shared_ptr<const void> pixels;
};
struct StoredColour {
  Image image;
  ColourFrame frame;
  std::shared_ptr<const void> pixels;
};

// Records with their heads, ready to be written; images as two, the second one their pixels. The
// pose that an image is fused at is that of its frame.
Bytes encode(const Begin& begin);
Bytes encode(const DepthFrame& frame, const Image& image);
Bytes encode(const ColourFrame& frame, const Image& image);
Bytes encode(const Region& region);
Bytes encodeLevel(const Eigen::Isometry3d& T_W_M);
Bytes encode(const Correction& correction);

// And back. Each throws std::exception for what is not such a record.
Begin readBegin(const Bytes& content);
Image readImage(const Bytes& content);  ///< Of either kind, without the pixels.
Region readRegion(const Bytes& content);
Eigen::Isometry3d readLevel(const Bytes& content);
Correction readCorrection(const Bytes& content);

/// What a record of a file holds, but for pixels and maps. @throws std::runtime_error if damaged.
Bytes readContent(const RecordFile& file, size_t record);

/// An image of a file, by its record, which that of its pixels follows.
StoredDepth readDepth(const RecordFile& file, size_t record);
StoredColour readColour(const RecordFile& file, size_t record);

}  // namespace journal
}  // namespace dtsdf
