/// From sensor_msgs to the mapper's frames, of depth and of colour: what is accepted, and what it
/// becomes.
#pragma once

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <cstddef>
#include <optional>
#include <string>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/pinhole.h"
#include "ros/input/frame_accounting.h"

namespace dtsdf {

/// Messages of one stamp.
struct CameraImage {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info = nullptr;
  sensor_msgs::ImageConstPtr mask = nullptr;  ///< Only where masks are wanted.
};

// What depth and colour images have in common: their camera, and whether their bytes fit it.

/// Intrinsics of a rectified image: P, or K where P is empty, with binning and the region of
/// interest applied.
Intrinsics intrinsicsOf(const sensor_msgs::CameraInfo& info);

/// The camera_info of a rectified image with these intrinsics.
sensor_msgs::CameraInfo makeCameraInfo(const sensor_msgs::Image& image, const Intrinsics& K);

/// Whether an image may wait at all, by its size, stamp and names; nothing if it may. `most_bytes`
/// is all the room.
std::optional<Rejection> checkArrival(const sensor_msgs::Image& image, size_t most_bytes);

/// Why a camera_info may not wait, by what it holds; empty if it may.
std::string findProblem(const sensor_msgs::CameraInfo& info);

/// What is wrong with an image of so many bytes a pixel and its camera_info; nothing if they fit.
std::optional<Rejection> checkImage(const sensor_msgs::Image& image,
                                    const sensor_msgs::CameraInfo& info, size_t pixel_bytes);

/// 16UC1, mono16 or 32FC1.
bool isDepthEncoding(const std::string& encoding);

/// What is wrong with an image, judged by its header and its camera_info; nothing if it is usable.
std::optional<Rejection> checkDepthImage(const sensor_msgs::Image& image,
                                         const sensor_msgs::CameraInfo& info);

/// The frame of an image that passed checkDepthImage(), without its pose. Its data live in
/// `pixels`, which shares them with the message, or has a copy where the byte order is not the
/// machine's or the rows are of no whole pixels.
/// @throws cv_bridge::Exception or cv::Exception for what the check should have refused.
DepthFrame makeDepthFrame(const sensor_msgs::ImageConstPtr& image,
                          const sensor_msgs::CameraInfo& info, cv_bridge::CvImageConstPtr& pixels,
                          float unit_16uc1_m = 0.001f, float unit_32fc1_m = 1.0f);

/// rgb8, bgr8, rgba8, bgra8, mono8, mono16, Bayer of 8 and 16 bits, YUV 4:2:2 (yuv422,
/// yuv422_yuy2).
bool isColourEncoding(const std::string& encoding);

/// Whether images of this encoding are hardly anything but a colour camera's: mono8 may be
/// infrared, mono16 depth.
bool showsColour(const std::string& encoding);

/// What is wrong with an image, judged by its header and its camera_info; nothing if it is usable.
std::optional<Rejection> checkColourImage(const sensor_msgs::Image& image,
                                          const sensor_msgs::CameraInfo& info);

/// The frame of an image that passed checkColourImage(), without its pose. Its data live in
/// `pixels`, which shares them with the message where the mapper knows the encoding, or has them
/// converted by cv_bridge.
/// @throws cv_bridge::Exception or cv::Exception for what cannot be converted, such as a Bayer
/// image of one pixel.
ColourFrame makeColourFrame(const sensor_msgs::ImageConstPtr& image,
                            const sensor_msgs::CameraInfo& info,
                            cv_bridge::CvImageConstPtr& pixels);

// Masks: what of a depth image is not of the scene, such as the robot's own arm.

/// What is wrong with a mask for a depth image that passed checkDepthImage(); nothing if it is
/// usable.
std::optional<Rejection> checkMask(const sensor_msgs::Image& mask, const sensor_msgs::Image& depth);

/// The depth image without measurements where the mask is not 0. Both have passed their checks.
sensor_msgs::ImageConstPtr applyMask(const sensor_msgs::Image& mask,
                                     const sensor_msgs::Image& depth);

// The two kinds of a camera's images, and what decodes compressed ones.

/// What image_transport appends to the name of an image's topic for its compressed images.
constexpr char kCompressedDepthTopic[] = "/compressedDepth";
constexpr char kCompressedTopic[] = "/compressed";

/// The topic of an image by itself, without these endings.
std::string withoutTransport(const std::string& topic);

/// Whether a message holds depth, by what its format says.
bool holdsDepth(const sensor_msgs::CompressedImage& message);

/// Without image_transport's plugins. @throws std::runtime_error that says what is wrong.
sensor_msgs::ImageConstPtr decodeDepth(const sensor_msgs::CompressedImage& message);

/// Whether a message holds the image of a colour camera, JPEG or PNG.
bool holdsColour(const sensor_msgs::CompressedImage& message);

/// As rgb8. @throws std::runtime_error that says what is wrong with the message.
sensor_msgs::ImageConstPtr decodeColour(const sensor_msgs::CompressedImage& message);

// Why an image is dropped, in words for the node and for bags.
inline std::string noInfoText(const std::string& topic, bool any_stamp) {
  return std::string("no camera_info") + (any_stamp ? "" : " with the same stamp") + " on '" +
         topic + "'; publish it with the image's stamp" +
         (any_stamp ? "" : ", or set input/camera_info: latest");
}
inline std::string noMaskText(const std::string& topic) {
  return "no mask with the same stamp on '" + topic + "'";
}
constexpr char kRepeatedStampText[] =
    "the image before has the same stamp, so one of them has a wrong pose";

/// What distinguishes depth images from colour images, which all else treats alike.
struct ImageKind {
  const char* ns;                ///< Namespace of the topics image_rect and camera_info.
  const char* transport_param;   ///< Private parameter with the transport of the images.
  const char* compressed_topic;  ///< Ending of the topic of images that are decoded here.
  sensor_msgs::ImageConstPtr (*decode)(const sensor_msgs::CompressedImage&);
  /// Whether images in a bag are hardly anything else, by encoding or by format.
  bool (*has_encoding)(const std::string&);
  bool (*has_format)(const sensor_msgs::CompressedImage&);
  /// What is wrong with an image; nothing if it is usable.
  std::optional<Rejection> (*check)(const sensor_msgs::Image&, const sensor_msgs::CameraInfo&);
  bool is_colour;
};

constexpr ImageKind kDepthImages = {
    "depth",         "image_transport", kCompressedDepthTopic, decodeDepth,
    isDepthEncoding, holdsDepth,        checkDepthImage,       false};
constexpr ImageKind kColourImages = {"color",          "color_image_transport",
                                     kCompressedTopic, decodeColour,
                                     showsColour,      holdsColour,
                                     checkColourImage, true};

}  // namespace dtsdf
