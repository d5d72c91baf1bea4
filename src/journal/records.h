/// The records of a journal and their contents; docs/map_format.md describes them byte by byte.
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

/// Four-letter code that identifies journals, and their file extension.
constexpr char kPurpose[] = "JRNL", kExtension[] = ".dtsdfj";

/// Kinds of records; the records of a map may follow kBegin.
constexpr char kBegin[] = "BEGN", kDepth[] = "DIMG", kColour[] = "CIMG", kPixels[] = "PIXL",
               kClear[] = "CLRG", kLevel[] = "TWM ", kCorrection[] = "CORR";

/// Begins a map, into which the images after this record are fused.
struct Begin {
  ParamTree settings;       ///< Settings of the mapper.
  PoseParams poses;         ///< Settings of the pose source and alignment.
  std::string map_frame;    ///< Name of the frame of the input poses.
  std::string level_frame;  ///< Name of the map's frame; equals map_frame unless levelled.
  bool has_map = false;     ///< Whether a map's records follow; otherwise the map is empty.
};

/// An image that the mapper processed at pose `frame`.T_W_C.
struct Image {
  double stamp_s = 0.0;
  uint32_t camera = 0;                                      ///< Index of the camera.
  Eigen::Isometry3d T_W_G = Eigen::Isometry3d::Identity();  ///< The input pose.
  std::variant<DepthFrame, ColourFrame> frame;
  std::shared_ptr<const void> pixels;  ///< Owns the frame's pixels.
};

/// Levels the map from here on: T_W_M maps the frame M of the input poses to the map frame W.
struct Level {
  Eigen::Isometry3d T_W_M;
};

/// Corrected poses of the first camera's images.
struct Correction {
  uint64_t before = 0;  ///< Number of Calls since kBegin when the correction arrived.
  std::vector<StampedPose> poses;
};

/// A change to the map. A Region means that this region was cleared.
using Call = std::variant<Image, Region, Level, Correction>;

/// Encodes records with their headers. An image becomes two records, of which the second contains
/// the pixels.
Bytes encode(const Begin& begin);
Bytes encode(const Call& call);

// The functions below read a record. @throws std::exception if it is damaged or, for readCall(),
// not a call.
Begin readBegin(const RecordFile& file, size_t record);
/// @param with_pixels Whether to read an image's pixels too, from the next record.
Call readCall(const RecordFile& file, size_t record, bool with_pixels = true);

}  // namespace journal
}  // namespace dtsdf
