#include "log/log_record.h"

#include <cstring>

#include "kernels/core/voxel.h"
#include "log/record_codes.h"

namespace dtsdf {
namespace {

constexpr uint32_t kMagic = 0x31524c44;  // "DLR1"
constexpr size_t kHashedHeadBytes = kLogHeadBytes - sizeof(uint64_t);

uint64_t headHash(const uint8_t* head, const std::string& description) {
  std::string all(reinterpret_cast<const char*>(head), kHashedHeadBytes);
  all += description;
  return hashOf(all.data(), all.size());
}

size_t bytesPerPixel(ColourEncoding encoding) {
  switch (encoding) {
    case ColourEncoding::kRgb8:
    case ColourEncoding::kBgr8: return 3;
    case ColourEncoding::kRgba8:
    case ColourEncoding::kBgra8: return 4;
    case ColourEncoding::kMono8: return 1;
  }
  DescriptionReader::throwMalformed();
}

void putImage(ByteWriter& out, const LogImage& image) {
  out.put(image.stamp_s).put(image.camera).putPose(image.T_W_C);
}

LogImage takeImage(DescriptionReader& in) {
  LogImage image;
  image.stamp_s = in.take<double>();
  image.camera = in.take<uint32_t>();
  image.T_W_C = in.takePose();
  return image;
}

/// Size, encoding and intrinsics, which both kinds of images have.
template <class Frame>
void putCamera(ByteWriter& out, const Frame& frame) {
  const Intrinsics& K = frame.intrinsics;
  out.put(static_cast<int32_t>(frame.encoding))
      .put(int32_t{frame.width})
      .put(int32_t{frame.height});
  out.put(K.fx).put(K.fy).put(K.cx).put(K.cy);
}

template <class Frame>
void takeCamera(DescriptionReader& in, Frame& frame) {
  frame.encoding = static_cast<decltype(frame.encoding)>(in.take<int32_t>());
  frame.width = in.take<int32_t>();
  frame.height = in.take<int32_t>();
  if (frame.width <= 0 || frame.height <= 0 || frame.width > kMaxPixels / frame.height) {
    DescriptionReader::throwMalformed();
  }
  Intrinsics& K = frame.intrinsics;
  for (float* const value : {&K.fx, &K.fy, &K.cx, &K.cy}) *value = in.take<float>();
}

template <class Frame>
size_t pixelsOf(const Frame& frame) {
  return static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
}

/// The pixels without what may follow a row.
template <class Value, class Frame>
std::vector<Value> packedRows(const Frame& frame, size_t values_per_pixel) {
  const size_t row = static_cast<size_t>(frame.width) * values_per_pixel;
  std::vector<Value> values(row * static_cast<size_t>(frame.height));
  for (size_t v = 0; v < static_cast<size_t>(frame.height); ++v) {
    std::memcpy(values.data() + v * row, static_cast<const char*>(frame.data) + v * frame.row_bytes,
                row * sizeof(Value));
  }
  return values;
}

void requireKind(LogKind kind, LogKind expected) {
  if (kind != expected) DescriptionReader::throwMalformed();
}

}  // namespace

std::string encodeRecord(const LogRecord& record, uint64_t number) {
  ByteWriter out;
  out.put(kMagic).put(static_cast<uint32_t>(record.kind)).put(number);
  out.put(static_cast<uint32_t>(record.description.size())).put(uint32_t{0});
  out.put(uint64_t{record.pixels.size()});
  out.put(hashOf(record.pixels.data(), record.pixels.size()));
  out.put(headHash(out.bytes.data(), record.description));
  return out.putText(record.description).text();
}

std::optional<LogHead> decodeHead(const uint8_t* bytes) {
  ByteReader in(bytes, kLogHeadBytes);
  if (in.take<uint32_t>() != kMagic) return std::nullopt;
  LogHead head;
  head.kind = static_cast<LogKind>(in.take<uint32_t>());
  head.number = in.take<uint64_t>();
  head.description_bytes = in.take<uint32_t>();
  in.take<uint32_t>();
  head.pixel_bytes = in.take<uint64_t>();
  head.pixel_hash = in.take<uint64_t>();
  if (head.description_bytes > kMostDescriptionBytes) return std::nullopt;
  return head;
}

bool isWhole(const uint8_t* head, const LogHead& decoded, const std::string& description) {
  return description.size() == decoded.description_bytes &&
         ByteReader(head + kHashedHeadBytes, sizeof(uint64_t)).take<uint64_t>() ==
             headHash(head, description);
}

bool isWhole(const LogHead& head, const std::string& pixels) {
  return pixels.size() == head.pixel_bytes &&
         hashOf(pixels.data(), pixels.size()) == head.pixel_hash;
}

LogRecord toRecord(const LogBegin& begin) {
  ByteWriter out;
  putString(out, map_format::settingsText(map_format::settingsOfFile(begin.settings, begin.poses)));
  putString(out, begin.map_frame);
  out.put(uint8_t{begin.has_map}).put(uint8_t{begin.continues}).put(uint8_t{begin.stands_for_lost});
  out.put(begin.stamp_s);
  return {LogKind::kBegin, out.text(), ""};
}

LogBegin readBegin(const std::string& description) {
  DescriptionReader in(description);
  LogBegin begin;
  ParamTree settings;
  if (!map_format::parseSettings(in.takeText(), settings)) DescriptionReader::throwMalformed();
  begin.poses = map_format::posesOf(settings);
  begin.settings = map_format::settingsOfFile(settings, PoseParams());  // without those of poses
  begin.map_frame = in.takeText();
  begin.has_map = in.take<uint8_t>() != 0;
  begin.continues = in.take<uint8_t>() != 0;
  begin.stands_for_lost = in.take<uint8_t>() != 0;
  begin.stamp_s = in.take<double>();
  in.finish();
  return begin;
}

LogRecord toRecord(const DepthFrame& frame, double stamp_s, uint32_t camera) {
  ByteWriter out;
  putImage(out, {stamp_s, camera, frame.T_W_C});
  putCamera(out, frame);
  out.put(frame.unit_m).put(uint8_t{frame.keep_center_W.has_value()});
  out.putVector(frame.keep_center_W.value_or(Eigen::Vector3d::Zero()));
  const size_t pixels = pixelsOf(frame);
  const bool is_16_bit = frame.encoding == DepthEncoding::kUint16;
  return {LogKind::kDepth, out.text(),
          is_16_bit ? packDepth16(packedRows<uint16_t>(frame, 1).data(), pixels)
                    : packFloats(packedRows<float>(frame, 1).data(), pixels)};
}

LogRecord toRecord(const ColourFrame& frame, double stamp_s, uint32_t camera) {
  ByteWriter out;
  putImage(out, {stamp_s, camera, frame.T_W_C});
  putCamera(out, frame);
  const size_t per_pixel = bytesPerPixel(frame.encoding);
  const std::vector<uint8_t> bytes = packedRows<uint8_t>(frame, per_pixel);
  return {LogKind::kColour, out.text(), packColours(bytes.data(), bytes.size(), per_pixel)};
}

LogImage readImage(LogKind kind, const std::string& description) {
  if (kind != LogKind::kDepth) requireKind(kind, LogKind::kColour);
  DescriptionReader in(description);
  return takeImage(in);
}

LoggedDepth readDepth(const LogRecord& record) {
  requireKind(record.kind, LogKind::kDepth);
  DescriptionReader in(record.description);
  LoggedDepth depth;
  depth.image = takeImage(in);
  DepthFrame& frame = depth.frame;
  takeCamera(in, frame);
  frame.unit_m = in.take<float>();
  const bool has_center = in.take<uint8_t>() != 0;
  const Eigen::Vector3d center_W = in.takeVector();
  in.finish();
  if (has_center) frame.keep_center_W = center_W;
  frame.T_W_C = depth.image.T_W_C;
  if (frame.encoding == DepthEncoding::kUint16) {
    depth.integers = unpackDepth16(record.pixels, pixelsOf(frame));
    frame.row_bytes = static_cast<size_t>(frame.width) * sizeof(uint16_t);
    frame.data = depth.integers.data();
  } else if (frame.encoding == DepthEncoding::kFloat32) {
    depth.floats = unpackFloats(record.pixels, pixelsOf(frame));
    frame.row_bytes = static_cast<size_t>(frame.width) * sizeof(float);
    frame.data = depth.floats.data();
  } else {
    DescriptionReader::throwMalformed();
  }
  return depth;
}

LoggedColour readColour(const LogRecord& record) {
  requireKind(record.kind, LogKind::kColour);
  DescriptionReader in(record.description);
  LoggedColour colour;
  colour.image = takeImage(in);
  ColourFrame& frame = colour.frame;
  takeCamera(in, frame);
  in.finish();
  frame.T_W_C = colour.image.T_W_C;
  const size_t per_pixel = bytesPerPixel(frame.encoding);
  frame.row_bytes = static_cast<size_t>(frame.width) * per_pixel;
  colour.bytes = unpackColours(record.pixels, pixelsOf(frame) * per_pixel, per_pixel);
  frame.data = colour.bytes.data();
  return colour;
}

LogRecord toRecord(const Region& region) {
  ByteWriter out;
  if (const auto* const box = std::get_if<BoxRegion>(&region)) {
    out.put(uint8_t{0}).putPose(box->T_W_B).putVector(box->size_m);
  } else {
    const auto& ball = std::get<SphereRegion>(region);
    out.put(uint8_t{1}).putVector(ball.center_W).put(ball.radius_m);
  }
  return {LogKind::kClearRegion, out.text(), ""};
}

Region readRegion(const std::string& description) {
  DescriptionReader in(description);
  Region region;
  if (in.take<uint8_t>() == 0) {
    BoxRegion box;
    box.T_W_B = in.takePose();
    box.size_m = in.takeVector();
    region = box;
  } else {
    SphereRegion ball;
    ball.center_W = in.takeVector();
    ball.radius_m = in.take<double>();
    region = ball;
  }
  in.finish();
  return region;
}

LogRecord levelRecord(const Eigen::Isometry3d& T_W_M) {
  return {LogKind::kLevel, ByteWriter().putPose(T_W_M).text(), ""};
}

Eigen::Isometry3d readLevel(const std::string& description) {
  DescriptionReader in(description);
  Eigen::Isometry3d T_W_M = in.takePose();
  in.finish();
  return T_W_M;
}

LogRecord toRecord(const LogCorrection& correction) {
  ByteWriter out;
  out.put(correction.before).put(correction.first_moved);
  out.put(uint64_t{correction.poses.size()});
  for (const StampedPose& pose : correction.poses) out.put(pose.stamp_s).putPose(pose.T_W_C);
  return {LogKind::kCorrection, out.text(), ""};
}

LogCorrection readCorrection(const std::string& description) {
  DescriptionReader in(description);
  LogCorrection correction;
  correction.before = in.take<uint64_t>();
  correction.first_moved = in.take<uint64_t>();
  const auto count = in.take<uint64_t>();
  for (uint64_t i = 0; i < count; ++i) {
    const auto stamp_s = in.take<double>();
    correction.poses.push_back({stamp_s, in.takePose()});
  }
  in.finish();
  return correction;
}

}  // namespace dtsdf
