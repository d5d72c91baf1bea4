#include "journal/records.h"

#include <array>
#include <cstring>
#include <stdexcept>

#include "dtsdf_mapping/io/yaml_params.h"
#include "io/depth_codes.h"
#include "io/map_format.h"
#include "params/printable.h"

namespace dtsdf {

// Read or write the contents of records, in file order.

template <class Io>
void fields(Io& io, BoxRegion& box) {
  io(box.T_W_B, box.size_m);
}

template <class Io>
void fields(Io& io, SphereRegion& ball) {
  io(ball.center_W, ball.radius_m);
}

template <class Io>
void fields(Io& io, Region& region) {
  bool is_sphere = std::holds_alternative<SphereRegion>(region);
  io(is_sphere);
  if (is_sphere && region.index() == 0) region = SphereRegion();
  std::visit(io, region);
}

template <class Io>
void fields(Io& io, StampedPose& pose) {
  io(pose.stamp_s, pose.T_W_C);
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
void fields(Io& io, Level& level) {
  io(level.T_W_M);
}

template <class Io>
void fields(Io& io, Correction& correction) {
  io(correction.before);
  io.rest(correction.poses);
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
  return encodeRecord(kPixels, kZstd, bytes);
}

template <class Frame>
std::shared_ptr<const void> readPixels(const RecordFile& file, size_t record, Frame& frame) {
  const size_t apart = bytesPerPixel(frame);
  frame.row_bytes = apart * static_cast<size_t>(frame.width);
  const size_t size = frame.row_bytes * static_cast<size_t>(frame.height);
  const auto bytes = std::make_shared<Bytes>(file.read(file.records()[record], size));
  if (bytes->size() != size) file.throwDamaged("the pixels of an image are missing");
  for (size_t i = apart; i < bytes->size(); ++i) {
    (*bytes)[i] = static_cast<uint8_t>((*bytes)[i] + (*bytes)[i - apart]);
  }
  frame.data = bytes->data();
  return bytes;
}

const char* kindOf(const Call& call) {
  static constexpr const char* kKinds[] = {kDepth, kClear, kLevel, kCorrection};
  const auto* const image = std::get_if<Image>(&call);
  return image && std::holds_alternative<ColourFrame>(image->frame) ? kColour
                                                                    : kKinds[call.index()];
}

/// A call of the kind to which the record belongs.
Call emptyCall(const RecordFile& file, const Record& record) {
  Image colour;
  colour.frame = ColourFrame();
  if (record.is(kColour)) return colour;
  if (record.is(kDepth)) return Image();
  if (record.is(kClear)) return Region();
  if (record.is(kLevel)) return Level();
  if (record.is(kCorrection)) return Correction();
  file.throwDamaged("a " + printable(record.name()) + " record is in the wrong place");
}

}  // namespace

Bytes encode(const Begin& begin) {
  ByteWriter out;
  out(map_format::settingsText(map_format::settingsOfFile(begin.settings, begin.poses)),
      begin.map_frame, begin.level_frame, begin.has_map);
  return encodeRecord(kBegin, 0, out.bytes);
}

Bytes encode(const Call& call) {
  ByteWriter out;
  std::visit(out, call);
  const uint32_t flags = std::holds_alternative<Correction>(call) ? kZstd : 0;
  Bytes records = encodeRecord(kindOf(call), flags, out.bytes);
  if (const auto* const image = std::get_if<Image>(&call)) {
    const Bytes pixels =
        std::visit([](const auto& frame) { return encodePixels(frame); }, image->frame);
    records.insert(records.end(), pixels.begin(), pixels.end());
  }
  return records;
}

Begin readBegin(const RecordFile& file, size_t record) {
  Begin begin;
  std::string text;
  file.visit(file.records()[record], kMaxBytes,
             [&](ByteReader& in) { in(text, begin.map_frame, begin.level_frame, begin.has_map); });
  const ParamTree settings = parseYamlParams(text, "its settings");
  begin.poses = map_format::posesOf(settings);
  begin.settings = map_format::settingsOfFile(settings, PoseParams());  // without poses/...
  return begin;
}

Call readCall(const RecordFile& file, size_t record, bool with_pixels) {
  Call call = emptyCall(file, file.records()[record]);
  file.visit(file.records()[record], kMaxBytes, [&](ByteReader& in) { std::visit(in, call); });
  if (auto* const image = std::get_if<Image>(&call); image != nullptr && with_pixels) {
    image->pixels =
        std::visit([&](auto& frame) { return readPixels(file, record + 1, frame); }, image->frame);
  }
  return call;
}

}  // namespace journal
}  // namespace dtsdf
