/// Checks sensor_msgs images and converts them to the mapper's depth and colour frames.
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

/// The messages of a frame.
struct CameraImage {
  sensor_msgs::ImageConstPtr image;
  sensor_msgs::CameraInfoConstPtr info = nullptr;
  sensor_msgs::ImageConstPtr mask = nullptr;  ///< Null unless masks are used.
};

// For depth and colour images.

/// Intrinsics of a rectified image: P, or K if P is empty, with binning and the region of interest
/// applied.
Intrinsics intrinsicsOf(const sensor_msgs::CameraInfo& info);

/// The camera_info of a rectified image with these intrinsics.
sensor_msgs::CameraInfo makeCameraInfo(const sensor_msgs::Image& image, const Intrinsics& K);

/// Why an image is refused on arrival (size, stamp or names); nothing if it is accepted.
/// `max_bytes` is the size of the queue, in bytes.
std::optional<Rejection> checkArrival(const sensor_msgs::Image& image, size_t max_bytes);

/// Why a camera_info is refused on arrival; empty if it is accepted.
std::string findProblem(const sensor_msgs::CameraInfo& info);

/// What is wrong with an image or its camera_info, except the encoding; nothing if both are usable.
std::optional<Rejection> checkImage(const sensor_msgs::Image& image,
                                    const sensor_msgs::CameraInfo& info, size_t pixel_bytes);

/// Whether an encoding is 16UC1, mono16 or 32FC1.
bool isDepthEncoding(const std::string& encoding);

/// What is wrong with an image, its camera_info or, if there is one, its mask; nothing if all are
/// usable.
std::optional<Rejection> checkDepthImage(const CameraImage& given);

/// The frame of an image that passed checkDepthImage(), without its pose. `pixels` owns its data:
/// shared with the message, or a copy if the byte order is not native or rows do not hold whole
/// pixels.
/// @throws cv_bridge::Exception or cv::Exception for images that the check should have refused.
DepthFrame makeDepthFrame(const sensor_msgs::ImageConstPtr& image,
                          const sensor_msgs::CameraInfo& info, cv_bridge::CvImageConstPtr& pixels,
                          float unit_16uc1_m = 0.001f, float unit_32fc1_m = 1.0f);

/// Whether an encoding is rgb8, bgr8, rgba8, bgra8, mono8, mono16, 8-bit or 16-bit Bayer, or YUV
/// 4:2:2 (yuv422, yuv422_yuy2).
bool isColourEncoding(const std::string& encoding);

/// Whether images with this encoding can only be from a colour camera. mono8 images may be
/// infrared, and mono16 images may be depth.
bool showsColour(const std::string& encoding);

/// What is wrong with an image or its camera_info; nothing if both are usable.
std::optional<Rejection> checkColourImage(const CameraImage& given);

/// The frame of an image that passed checkColourImage(), without its pose. `pixels` owns its data:
/// shared with the message if the mapper supports the encoding, otherwise a converted copy.
/// @throws cv_bridge::Exception or cv::Exception if the image cannot be converted, such as a Bayer
/// image with a single pixel.
ColourFrame makeColourFrame(const sensor_msgs::ImageConstPtr& image,
                            const sensor_msgs::CameraInfo& info,
                            cv_bridge::CvImageConstPtr& pixels);

// Masks hide parts of a depth image that do not belong to the scene, such as the robot's arm.

/// A copy of the depth image, without measurements where the mask is not 0. @pre Both have passed
/// their checks.
sensor_msgs::ImageConstPtr applyMask(const sensor_msgs::Image& mask,
                                     const sensor_msgs::Image& depth);

// Compressed images.

/// Suffixes that image_transport adds to topics of compressed images.
constexpr char kCompressedDepthTopic[] = "/compressedDepth";
constexpr char kCompressedTopic[] = "/compressed";

/// The topic without its compressed suffix, if it has one.
std::string withoutTransport(const std::string& topic);

/// Whether a message holds depth, according to its format.
bool holdsDepth(const sensor_msgs::CompressedImage& message);

/// Decodes without image_transport's plugins. @throws std::runtime_error that says what is wrong.
sensor_msgs::ImageConstPtr decodeDepth(const sensor_msgs::CompressedImage& message);

/// Whether a message holds a JPEG or PNG image from a colour camera.
bool holdsColour(const sensor_msgs::CompressedImage& message);

/// Decodes to rgb8. @throws std::runtime_error that says what is wrong with the message.
sensor_msgs::ImageConstPtr decodeColour(const sensor_msgs::CompressedImage& message);

// Texts for dropped images, used by the node and for bags.
inline std::string noInfoText(const std::string& topic, bool any_stamp) {
  return std::string("no camera_info") + (any_stamp ? "" : " with the same stamp") + " on '" +
         topic + "'; publish it" +
         (any_stamp ? "" : " with the image's stamp, or set input/camera_info: latest");
}
inline std::string noMaskText(const std::string& topic) {
  return "no mask with the same stamp on '" + topic + "'; each image needs a mask";
}
constexpr char kRepeatedStampText[] =
    "the previous image has the same stamp, so one of the two would get a wrong pose";

/// Differences between depth and colour images.
struct ImageKind {
  const char* ns;                ///< Namespace of the topics image_rect and camera_info.
  const char* transport_param;   ///< Private parameter with the transport of the images.
  const char* compressed_topic;  ///< Suffix of topics whose images are decoded here.
  sensor_msgs::ImageConstPtr (*decode)(const sensor_msgs::CompressedImage&);
  /// Whether an image in a bag counts as one of this kind, judging by its encoding or format.
  bool (*has_encoding)(const std::string&);
  bool (*has_format)(const sensor_msgs::CompressedImage&);
  /// What is wrong with an image; nothing if it is usable.
  std::optional<Rejection> (*check)(const CameraImage&);
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
