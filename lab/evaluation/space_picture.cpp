#include "evaluation/space_picture.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "evaluation/parallel.h"
#include "params/text.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

const cv::Vec3b kUnknown(205, 205, 205), kSurface(70, 60, 110), kTrueSurface(0, 0, 0);

/// From red at a surface over yellow and green to blue.
cv::Vec3b distanceColour(double share) {
  constexpr double kStops[5][3] = {
      {80, 80, 235}, {80, 190, 250}, {150, 235, 200}, {215, 200, 120}, {190, 110, 60}};  // BGR
  const double at = 4.0 * std::clamp(share, 0.0, 1.0);
  const int stop = std::min(3, static_cast<int>(at));
  cv::Vec3b colour;
  for (int i = 0; i < 3; ++i) {
    const double low = kStops[stop][i], high = kStops[stop + 1][i];
    colour[i] = static_cast<uint8_t>(low + (at - stop) * (high - low) + 0.5);
  }
  return colour;
}

class SlicePainter {
 public:
  SlicePainter(const Space& space, const SpaceTruth& truth, const SliceOptions& options)
      : space_(space), truth_(truth), options_(options) {}

  cv::Mat paint() const {
    const Vector3d size = options_.bounds_W.sizes() / options_.pixel_m;
    cv::Mat image(static_cast<int>(size.y()), static_cast<int>(size.x()), CV_8UC3);
    forEachIndex(static_cast<size_t>(image.rows), [&](size_t row) {
      const int v = static_cast<int>(row);
      for (int u = 0; u < image.cols; ++u) {
        image.at<cv::Vec3b>(v, u) = colourAt(pointOf(u, image.rows - 1 - v));
      }
    });
    drawPath(image);
    drawLegend(image);
    return image;
  }

 private:
  Vector3d pointOf(int right, int up) const {
    const Vector3d offset((right + 0.5) * options_.pixel_m, (up + 0.5) * options_.pixel_m,
                          0.5 * options_.bounds_W.sizes().z());
    return options_.bounds_W.min() + offset;
  }

  cv::Vec3b colourAt(const Vector3d& p_W) const {
    const auto true_m = truth_.distanceFrom(p_W);
    if (true_m && true_m->to_seen_m < 0.6 * options_.pixel_m) return kTrueSurface;
    switch (space_.stateOf(space_.cellAt(p_W))) {
      case CellState::kUnknown: return kUnknown;
      case CellState::kSurface: return kSurface;
      case CellState::kFree: break;
    }
    return distanceColour(static_cast<double>(space_.distanceAt(p_W).distance_m) /
                          options_.full_scale_m);
  }

  void drawPath(cv::Mat& image) const {
    std::vector<cv::Point> pixels;
    for (const Vector3d& p_W : options_.path_W) {
      const Vector3d at = (p_W - options_.bounds_W.min()) / options_.pixel_m;
      pixels.emplace_back(static_cast<int>(at.x()), image.rows - 1 - static_cast<int>(at.y()));
    }
    cv::polylines(image, pixels, false, cv::Scalar(160, 0, 160), 2, cv::LINE_AA);
  }

  void drawLegend(cv::Mat& image) const {
    constexpr int kBar = 120, kHeight = 8, kLeft = 10, kTop = 8;
    for (int x = 0; x < kBar; ++x) {
      const cv::Vec3b c = distanceColour(static_cast<double>(x) / kBar);
      cv::line(image, {kLeft + x, kTop}, {kLeft + x, kTop + kHeight}, cv::Scalar(c));
    }
    cv::rectangle(image, {kLeft, kTop}, {kLeft + kBar, kTop + kHeight}, cv::Scalar::all(60));
    cv::putText(image, formatted("0 to %.3g m", options_.full_scale_m),
                {kLeft + kBar + 8, kTop + kHeight}, cv::FONT_HERSHEY_SIMPLEX, 0.4,
                cv::Scalar::all(40), 1, cv::LINE_AA);
  }

  const Space& space_;
  const SpaceTruth& truth_;
  const SliceOptions& options_;
};

}  // namespace

void writeSlice(const std::string& path, const Space& space, const SpaceTruth& truth,
                const SliceOptions& options) {
  const cv::Mat image = SlicePainter(space, truth, options).paint();
  if (image.empty()) throw std::runtime_error(path + ": the slice has no pixels");
  if (!cv::imwrite(path, image)) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace dtsdf
