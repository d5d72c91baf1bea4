/// What a journal holds, and its records: docs/map_format.md describes them byte by byte.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
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
  ParamTree settings;       ///< Settings of the mapper.
  PoseParams poses;         ///< How the poses of images were found.
  std::string map_frame;    ///< Name of the frame that poses are given in.
  std::string level_frame;  ///< Name of the frame that the map is in; the same unless levelled.
  bool has_map = false;     ///< Records of the map follow; else it is empty.
};

/// An image that was fused or painted, at the pose of its frame.
struct Image {
  double stamp_s = 0.0;
  uint32_t camera = 0;                                      ///< Its place among the cameras.
  Eigen::Isometry3d T_W_G = Eigen::Isometry3d::Identity();  ///< Pose as it was given.
  std::variant<DepthFrame, ColourFrame> frame;
  std::shared_ptr<const void> pixels;  ///< What those of the frame live in.
};

/// Where the frame that poses are given in lies in that of the map, from here on.
struct Level {
  Eigen::Isometry3d T_W_M;
};

/// Poses of the first camera's images that were corrected.
struct Correction {
  uint64_t before = 0;  ///< Records since kBegin when it came: only those were fused by then.
  std::vector<StampedPose> poses;
};

/// What happened to the map; a region was emptied.
using Call = std::variant<Image, Region, Level, Correction>;

/// Records with their heads, ready to be written; an image is two, the second one its pixels.
Bytes encode(const Begin& begin);
Bytes encode(const Call& call);

// Each reads a record of a file back. @throws std::exception if it is damaged, or of another kind.
Begin readBegin(const RecordFile& file, size_t record);
/// An image without pixels has no data; with them, the record that follows is read as well.
Call readCall(const RecordFile& file, size_t record, bool with_pixels = true);

}  // namespace journal
}  // namespace dtsdf
