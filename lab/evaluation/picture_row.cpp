#include "evaluation/picture_row.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace dtsdf {

void joinPictures(const std::string& path, const std::vector<TitledPicture>& pictures) {
  constexpr int kTitle_px = 26, kGap_px = 10, kBaseline_px = 18;
  std::vector<cv::Mat> images;
  int width = -kGap_px, height = 0;
  for (const TitledPicture& picture : pictures) {
    images.push_back(cv::imread(picture.path, cv::IMREAD_COLOR));
    if (images.back().empty()) throw std::runtime_error(picture.path + ": no picture");
    width += images.back().cols + kGap_px;
    height = std::max(height, images.back().rows);
  }
  if (images.empty()) throw std::runtime_error(path + ": no pictures to join");
  cv::Mat row(height + kTitle_px, width, CV_8UC3, cv::Scalar::all(255));
  int left = 0;
  for (size_t i = 0; i < images.size(); ++i) {
    images[i].copyTo(row(cv::Rect(left, kTitle_px, images[i].cols, images[i].rows)));
    cv::putText(row, pictures[i].title, {left + 6, kBaseline_px}, cv::FONT_HERSHEY_SIMPLEX, 0.55,
                cv::Scalar::all(40), 1, cv::LINE_AA);
    left += images[i].cols + kGap_px;
  }
  if (!cv::imwrite(path, row, {cv::IMWRITE_PNG_COMPRESSION, 9})) {
    throw std::runtime_error(path + ": cannot be written");
  }
}

}  // namespace dtsdf
