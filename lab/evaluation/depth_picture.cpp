#include "evaluation/depth_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace dtsdf {

namespace {

constexpr Colour kUncovered{250, 185, 30}, kUnmeasured{255, 255, 255};
constexpr double kFits = 0.01, kFullColour = 0.05;
constexpr int kLeastWidth_px = 480;  // for the legend

cv::Vec3b toBgrPixel(const Colour& c) { return {c[2], c[1], c[0]}; }

cv::Mat drawDifferences(const std::vector<float>& measured_m, const DepthView& mesh,
                        const ViewCamera& camera) {
  cv::Mat image(camera.height, camera.width, CV_8UC3);
  size_t i = 0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u, ++i) {
      const double measured = static_cast<double>(measured_m[i]);
      const double predicted = static_cast<double>(mesh.depth_m[i]);
      Colour colour = measured > 0.0 ? kUncovered : kUnmeasured;
      if (measured > 0.0 && predicted > 0.0) {
        colour = differenceColour((predicted - measured) / measured,
                                  static_cast<double>(mesh.incidence_cosine[i]));
      }
      image.at<cv::Vec3b>(v, u) = toBgrPixel(colour);
    }
  }
  return image;
}

/// A strip as wide as the image: what each colour stands for, beside one another.
cv::Mat drawKey(int width) {
  constexpr int kHeight = 26, kSwatch = 22, kTop = 7, kBottom = 19;
  struct Entry {
    const char* text;
    Colour from, to;
  };
  const Entry entries[] = {
      {"in front", differenceColour(-kFits, 1.0), differenceColour(-kFullColour, 1.0)},
      {"fits", differenceColour(0.0, 1.0), differenceColour(0.0, 1.0)},
      {"behind", differenceColour(kFits, 1.0), differenceColour(kFullColour, 1.0)},
      {"no mesh", kUncovered, kUncovered},
      {"not measured", kUnmeasured, kUnmeasured}};
  cv::Mat strip(kHeight, width, CV_8UC3, cv::Scalar::all(255));
  int left = 6;
  for (const Entry& entry : entries) {
    for (int x = 0; x < kSwatch; ++x) {
      const double share = static_cast<double>(x) / (kSwatch - 1);
      Colour c;
      for (size_t k = 0; k < 3; ++k) {
        c[k] = static_cast<uint8_t>(entry.from[k] + share * (entry.to[k] - entry.from[k]));
      }
      cv::line(strip, {left + x, kTop}, {left + x, kBottom}, cv::Scalar(c[2], c[1], c[0]));
    }
    cv::rectangle(strip, {left, kTop}, {left + kSwatch, kBottom}, cv::Scalar::all(90));
    left += kSwatch + 5;
    cv::putText(strip, entry.text, {left, kBottom - 2}, cv::FONT_HERSHEY_SIMPLEX, 0.4,
                cv::Scalar::all(40), 1, cv::LINE_AA);
    int below = 0;
    left += cv::getTextSize(entry.text, cv::FONT_HERSHEY_SIMPLEX, 0.4, 1, &below).width + 14;
  }
  return strip;
}

}  // namespace

Colour differenceColour(double behind_share, double incidence_cosine) {
  constexpr double kGrey[3] = {215, 215, 212};
  constexpr double kFront[3] = {205, 25, 25}, kBehind[3] = {25, 80, 215};
  const double strength =
      std::clamp((std::abs(behind_share) - kFits) / (kFullColour - kFits), 0.0, 1.0);
  const double* const towards = behind_share < 0.0 ? kFront : kBehind;
  const double light = 0.45 + 0.55 * std::clamp(incidence_cosine, 0.0, 1.0);
  Colour colour;
  for (size_t i = 0; i < 3; ++i) {
    colour[i] = static_cast<uint8_t>(light * (kGrey[i] + strength * (towards[i] - kGrey[i])) + 0.5);
  }
  return colour;
}

void writeDepthPicture(const std::string& path, const std::vector<float>& measured_m,
                       const DepthView& mesh, const ViewCamera& camera) {
  cv::Mat image = drawDifferences(measured_m, mesh, camera), picture;
  const int scale = (kLeastWidth_px + image.cols - 1) / image.cols;
  cv::resize(image, image, {}, scale, scale, cv::INTER_NEAREST);
  cv::vconcat(image, drawKey(image.cols), picture);
  if (!cv::imwrite(path, picture)) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace dtsdf
