#include "journal/records.h"

#include <array>
#include <cstring>
#include <stdexcept>

#include "dtsdf_mapping/io/yaml_params.h"
#include "io/depth_codes.h"
#include "io/map_format.h"
#include "params/printable.h"

namespace dtsdf {

// Read or write the fields of regions, images and corrections, in file order.

template <class Io>
void fields(Io& io, BoxRegion& box) {
  io(box.T_W_B, box.size_m);
}

template <class Io>
void fields(Io& io, SphereRegion& ball) {
  io(ball.center_W, ball.radius_m);
}

namespace journal {

template <class Io>
void fields(Io& io, Image& image) {
  io(image.stamp_s, image.camera, image.T_W_G);
  std::visit(
      [&io](auto& frame) {
        Intrinsics& K = frame.intrinsics;
        io(frame.T_W_C, frame.encoding, frame.width, frame.height, K.fx, K.fy, K.cx, K.cy);
      },
      image.frame);
  auto* const depth = std::get_if<DepthFrame>(&image.frame);
  if (depth == nullptr) return;
  bool has_center = depth->keep_center_W.has_value();
  Eigen::Vector3d center_W = depth->keep_center_W.value_or(Eigen::Vector3d::Zero());
  io(depth->unit_m, has_center, center_W);
  if (has_center) depth->keep_center_W = center_W;
}

template <class Io>
void fields(Io& io, Correction& correction) {
  io(correction.before);
  for (StampedPose& pose : correction.poses) io(pose.stamp_s, pose.T_W_C);
}

namespace {

/// Maximum content of a record without pixels, in bytes.
constexpr uint64_t kMaxBytes = uint64_t{1} << 30;

size_t bytesPerPixel(const DepthFrame& frame) {
  return std::array<size_t, 2>{2, 4}.at(static_cast<size_t>(frame.encoding));
}

size_t bytesPerPixel(const ColourFrame& frame) {
  return std::array<size_t, 5>{3, 3, 4, 4, 1}.at(static_cast<size_t>(frame.encoding));
}

/// Encodes an image without row padding. Each byte is stored as its difference from the same byte
/// of the preceding pixel; zstd compresses these differences well.
template <class Frame>
Bytes encodePixels(const Frame& frame) {
  const size_t apart = bytesPerPixel(frame), row = apart * static_cast<size_t>(frame.width);
  Bytes bytes(row * static_cast<size_t>(frame.height));
  for (size_t v = 0; v < static_cast<size_t>(frame.height); ++v) {
    std::memcpy(bytes.data() + v * row, static_cast<const char*>(frame.data) + v * frame.row_bytes,
                row);
  }
  for (size_t i = bytes.size(); i-- > apart;) {
    bytes[i] = static_cast<uint8_t>(bytes[i] - bytes[i - apart]);
  }
  return encodeRecord(kPixels, kZstd, bytes.data(), bytes.size());
}

template <class Frame>
std::shared_ptr<const void> readPixels(const RecordFile& file, size_t record, Frame& frame) {
  if (record >= file.records().size() || !file.records()[record].is(kPixels)) {
    file.throwDamaged("the pixels of an image are missing");
  }
  const size_t apart = bytesPerPixel(frame);
  frame.row_bytes = apart * static_cast<size_t>(frame.width);
  const auto bytes = std::make_shared<Bytes>(
      file.read(file.records()[record], frame.row_bytes * static_cast<size_t>(frame.height)));
  for (size_t i = apart; i < bytes->size(); ++i) {
    (*bytes)[i] = static_cast<uint8_t>((*bytes)[i] + (*bytes)[i - apart]);
  }
  frame.data = bytes->data();
  return bytes;
}

template <class Content>
Bytes encodeContent(const char* kind, const Content& content, uint32_t flags = 0) {
  ByteWriter out;
  out(content);
  return encodeRecord(kind, flags, out.bytes.data(), out.bytes.size());
}

Bytes recordOf(const Image& image) {
  Bytes records =
      encodeContent(std::holds_alternative<DepthFrame>(image.frame) ? kDepth : kColour, image);
  const Bytes pixels =
      std::visit([](const auto& frame) { return encodePixels(frame); }, image.frame);
  records.insert(records.end(), pixels.begin(), pixels.end());
  return records;
}

Bytes recordOf(const Region& region) {
  ByteWriter out;
  out(static_cast<uint8_t>(region.index()));
  std::visit([&out](const auto& shape) { out(shape); }, region);
  return encodeRecord(kClear, 0, out.bytes.data(), out.bytes.size());
}

Bytes recordOf(const Level& level) { return encodeContent(kLevel, level.T_W_M); }

Bytes recordOf(const Correction& correction) {
  return encodeContent(kCorrection, correction, kZstd);
}

Image readImage(ByteReader& in, bool is_depth) {
  Image image;
  if (!is_depth) image.frame = ColourFrame();
  in(image);
  std::visit(
      [](const auto& frame) {
        if (frame.width > 0 && frame.height > 0 &&
            static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height) <=
                maxImagePixels()) {
          return;
        }
        throw std::runtime_error("an image in the journal has an invalid size");
      },
      image.frame);
  return image;
}

Region readRegion(ByteReader& in) {
  Region region;
  if (in.take<uint8_t>() != 0) region = SphereRegion();
  std::visit([&in](auto& shape) { in(shape); }, region);
  return region;
}

}  // namespace

Bytes encode(const Begin& begin) {
  ByteWriter out;
  out(map_format::settingsText(map_format::settingsOfFile(begin.settings, begin.poses)),
      begin.map_frame, begin.level_frame, begin.has_map);
  return encodeRecord(kBegin, 0, out.bytes.data(), out.bytes.size());
}

Bytes encode(const Call& call) {
  return std::visit([](const auto& content) { return recordOf(content); }, call);
}

Begin readBegin(const RecordFile& file, size_t record) {
  const Bytes content = file.readAny(file.records()[record], kMaxBytes);
  ByteReader in(content);
  Begin begin;
  std::string text;
  in(text, begin.map_frame, begin.level_frame, begin.has_map);
  try {
    const ParamTree settings = parseYamlParams(text, "its settings");
    begin.poses = map_format::posesOf(settings);
    begin.settings = map_format::settingsOfFile(settings, PoseParams());  // without poses/...
  } catch (const std::runtime_error& error) {
    file.throwDamaged(error.what());
  }
  return begin;
}

Call readCall(const RecordFile& file, size_t record, bool with_pixels) {
  const Record& head = file.records()[record];
  const Bytes content = file.readAny(head, kMaxBytes);
  ByteReader in(content);
  if (head.is(kDepth) || head.is(kColour)) {
    Image image = readImage(in, head.is(kDepth));
    if (with_pixels) {
      image.pixels =
          std::visit([&](auto& frame) { return readPixels(file, record + 1, frame); }, image.frame);
    }
    return image;
  }
  if (head.is(kClear)) return readRegion(in);
  if (head.is(kLevel)) return Level{in.take<Eigen::Isometry3d>()};
  if (head.is(kCorrection)) {
    Correction correction;
    correction.poses.resize(content.size() / (sizeof(double) + kPoseBytes));
    in(correction);
    return correction;
  }
  file.throwDamaged("a " + printable(head.name()) + " record is in the wrong place");
}

}  // namespace journal
}  // namespace dtsdf
