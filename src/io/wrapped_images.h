/// Wraps an image source in order to modify its images, add images, or read ahead.
#pragma once

#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

template <class Image>
class WrappedImages : public ImageSource<Image> {
 public:
  using Next = std::function<std::optional<Image>(ImageSource<Image>&)>;

  /// @param next Returns the next image, from the source or elsewhere.
  WrappedImages(std::unique_ptr<ImageSource<Image>> source, Next next)
      : source_(std::move(source)), next_(std::move(next)) {}

  std::optional<size_t> size() const override { return source_->size(); }
  std::optional<size_t> posed() const override { return source_->posed(); }
  std::optional<Image> next() override { return next_(*source_); }
  const std::map<std::string, size_t>& skipped() const override { return source_->skipped(); }
  std::map<std::string, std::string> problems() const override { return source_->problems(); }

 private:
  const std::unique_ptr<ImageSource<Image>> source_;
  const Next next_;
};

/// A source whose images are modified by `change`.
template <class Image, class Change>
std::unique_ptr<ImageSource<Image>> changed(std::unique_ptr<ImageSource<Image>> source,
                                            Change change) {
  return std::make_unique<WrappedImages<Image>>(
      std::move(source), [change = std::move(change)](ImageSource<Image>& images) {
        std::optional<Image> image = images.next();
        if (image) change(*image);
        return image;
      });
}

/// Decodes each frame of a source on another thread while the previous one is used. If the source
/// throws, next() throws that error in place of the frame, and again on every subsequent call.
/// @pre skipped() and problems() are called only after next() has returned std::nullopt or thrown;
/// until then, the other thread may change their results.
inline std::unique_ptr<FrameSource> readAhead(std::unique_ptr<FrameSource> source) {
  return std::make_unique<WrappedImages<SourceFrame>>(
      std::move(source),
      [next = std::shared_future<std::optional<SourceFrame>>()](FrameSource& frames) mutable {
        const auto read = [&frames] { return frames.next(); };
        if (!next.valid()) next = std::async(std::launch::async, read);
        std::optional<SourceFrame> frame = next.get();
        if (frame) next = std::async(std::launch::async, read);
        return frame;
      });
}

}  // namespace dtsdf
