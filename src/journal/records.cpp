#include "journal/records.h"

#include <cstring>
#include <stdexcept>

#include "io/depth_codes.h"
#include "io/map_format.h"

namespace dtsdf {
namespace journal {
namespace {

/// More than any record has without pixels; a correction has at most a pose per image.
constexpr uint64_t kMostMeta = 4 << 20, kMostCorrection = uint64_t{1} << 29;
/// RVL takes six groups of 4 bits a pixel at worst, and two that begin its run.
constexpr size_t kMostRvlBytesPerPixel = 4;

[[noreturn]] void throwMalformed() { throw std::runtime_error("a record of it is malformed"); }

void requireEnd(const ByteReader& in) {
  if (in.left() > 0) throwMalformed();
}

size_t bytesPerPixel(ColourEncoding encoding) {
  switch (encoding) {
    case ColourEncoding::kRgb8:
    case ColourEncoding::kBgr8: return 3;
    case ColourEncoding::kRgba8:
    case ColourEncoding::kBgra8: return 4;
    case ColourEncoding::kMono8: return 1;
  }
  throwMalformed();
}

template <class Frame>
size_t pixelsOf(const Frame& frame) {
  return static_cast<size_t>(frame.width) * static_cast<size_t>(frame.height);
}

void putImage(ByteWriter& out, const Image& image, const Eigen::Isometry3d& T_W_C) {
  out.put(image.stamp_s).put(image.camera).putPose(image.T_W_G).putPose(T_W_C);
}

Image takeImage(ByteReader& in) {
  Image image;
  image.stamp_s = in.take<double>();
  image.camera = in.take<uint32_t>();
  image.T_W_G = in.takePose();
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
void takeCamera(ByteReader& in, Frame& frame) {
  frame.encoding = static_cast<decltype(frame.encoding)>(in.take<int32_t>());
  frame.width = in.take<int32_t>();
  frame.height = in.take<int32_t>();
  if (frame.width <= 0 || frame.height <= 0 || pixelsOf(frame) > mostImagePixels()) {
    throwMalformed();
  }
  Intrinsics& K = frame.intrinsics;
  for (float* const value : {&K.fx, &K.fy, &K.cx, &K.cy}) *value = in.take<float>();
}

/// The rows of an image without what may follow each.
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

// Codes of pixels that zstd then makes small, bit for bit.

/// Differences of the bits of numbers, byte by byte.
Bytes planesOf(const std::vector<float>& values) {
  const size_t count = values.size();
  Bytes planes(4 * count);
  uint32_t before = 0;
  for (size_t i = 0; i < count; ++i) {
    uint32_t bits;
    std::memcpy(&bits, &values[i], sizeof(bits));
    for (size_t plane = 0; plane < 4; ++plane) {
      planes[plane * count + i] = static_cast<uint8_t>((bits - before) >> (8 * plane));
    }
    before = bits;
  }
  return planes;
}

std::vector<float> numbersOf(const Bytes& planes, size_t count) {
  if (planes.size() != 4 * count) throwMalformed();
  std::vector<float> values(count);
  uint32_t bits = 0;
  for (size_t i = 0; i < count; ++i) {
    for (size_t plane = 0; plane < 4; ++plane) {
      bits += uint32_t{planes[plane * count + i]} << (8 * plane);
    }
    std::memcpy(&values[i], &bits, sizeof(bits));
  }
  return values;
}

/// Differences of bytes that lie a pixel apart.
Bytes differencesOf(const Bytes& bytes, size_t apart) {
  Bytes differences = bytes;
  for (size_t i = apart; i < bytes.size(); ++i) {
    differences[i] = static_cast<uint8_t>(bytes[i] - bytes[i - apart]);
  }
  return differences;
}

void sumUp(Bytes& bytes, size_t apart) {
  for (size_t i = apart; i < bytes.size(); ++i) {
    bytes[i] = static_cast<uint8_t>(bytes[i] + bytes[i - apart]);
  }
}

Bytes plain(const char* kind, const Bytes& content) {
  return encodeRecord(kind, 0, content.data(), content.size());
}

Bytes withPixels(const char* kind, const Bytes& content, const Bytes& pixels) {
  Bytes records = plain(kind, content);
  const Bytes second = encodeRecord(kPixels, kZstd, pixels.data(), pixels.size());
  records.insert(records.end(), second.begin(), second.end());
  return records;
}

const Record& pixelsAfter(const RecordFile& file, size_t record) {
  if (record + 1 >= file.records().size() || !file.records()[record + 1].is(kPixels)) {
    throwMalformed();
  }
  return file.records()[record + 1];
}

template <class Value>
std::shared_ptr<const void> keep(std::vector<Value> values, const void*& data) {
  const auto kept = std::make_shared<const std::vector<Value>>(std::move(values));
  data = kept->data();
  return kept;
}

}  // namespace

Bytes encode(const Begin& begin) {
  ByteWriter out;
  out.putString(map_format::settingsText(map_format::settingsOfFile(begin.settings, begin.poses)));
  out.putString(begin.map_frame).putString(begin.level_frame).put(uint8_t{begin.has_map});
  return plain(kBegin, out.bytes);
}

Begin readBegin(const Bytes& content) {
  ByteReader in(content);
  Begin begin;
  ParamTree settings;
  if (!map_format::parseSettings(in.takeString(), settings)) throwMalformed();
  begin.poses = map_format::posesOf(settings);
  begin.settings = map_format::settingsOfFile(settings, PoseParams());  // without those of poses
  begin.map_frame = in.takeString();
  begin.level_frame = in.takeString();
  begin.has_map = in.take<uint8_t>() != 0;
  requireEnd(in);
  return begin;
}

Bytes encode(const DepthFrame& frame, const Image& image) {
  ByteWriter out;
  putImage(out, image, frame.T_W_C);
  putCamera(out, frame);
  out.put(frame.unit_m).put(uint8_t{frame.keep_center_W.has_value()});
  out.putVector(frame.keep_center_W.value_or(Eigen::Vector3d::Zero()));
  return withPixels(kDepth, out.bytes,
                    frame.encoding == DepthEncoding::kUint16
                        ? encodeRvl(packedRows<uint16_t>(frame, 1).data(), pixelsOf(frame))
                        : planesOf(packedRows<float>(frame, 1)));
}

Bytes encode(const ColourFrame& frame, const Image& image) {
  ByteWriter out;
  putImage(out, image, frame.T_W_C);
  putCamera(out, frame);
  const size_t per_pixel = bytesPerPixel(frame.encoding);
  return withPixels(kColour, out.bytes,
                    differencesOf(packedRows<uint8_t>(frame, per_pixel), per_pixel));
}

Image readImage(const Bytes& content) {
  ByteReader in(content);
  return takeImage(in);
}

Bytes readContent(const RecordFile& file, size_t record) {
  const Record& head = file.records()[record];
  return file.readAny(head, head.is(kCorrection) ? kMostCorrection : kMostMeta);
}

StoredDepth readDepth(const RecordFile& file, size_t record) {
  const Bytes content = readContent(file, record);
  ByteReader in(content);
  StoredDepth depth;
  depth.image = takeImage(in);
  DepthFrame& frame = depth.frame;
  takeCamera(in, frame);
  frame.unit_m = in.take<float>();
  const bool has_center = in.take<uint8_t>() != 0;
  const Eigen::Vector3d center_W = in.takeVector();
  requireEnd(in);
  if (has_center) frame.keep_center_W = center_W;
  frame.T_W_C = depth.image.T_W_C;
  const size_t pixels = pixelsOf(frame);
  const bool is_whole = frame.encoding == DepthEncoding::kUint16;
  if (!is_whole && frame.encoding != DepthEncoding::kFloat32) throwMalformed();
  const Bytes code = file.readAny(pixelsAfter(file, record), kMostRvlBytesPerPixel * pixels + 64);
  frame.row_bytes =
      static_cast<size_t>(frame.width) * (is_whole ? sizeof(uint16_t) : sizeof(float));
  depth.pixels = is_whole ? keep(decodeRvl(code.data(), code.size(), pixels), frame.data)
                          : keep(numbersOf(code, pixels), frame.data);
  return depth;
}

StoredColour readColour(const RecordFile& file, size_t record) {
  const Bytes content = readContent(file, record);
  ByteReader in(content);
  StoredColour colour;
  colour.image = takeImage(in);
  ColourFrame& frame = colour.frame;
  takeCamera(in, frame);
  requireEnd(in);
  frame.T_W_C = colour.image.T_W_C;
  const size_t per_pixel = bytesPerPixel(frame.encoding);
  frame.row_bytes = static_cast<size_t>(frame.width) * per_pixel;
  Bytes bytes = file.read(pixelsAfter(file, record), pixelsOf(frame) * per_pixel);
  sumUp(bytes, per_pixel);
  colour.pixels = keep(std::move(bytes), frame.data);
  return colour;
}

Bytes encode(const Region& region) {
  ByteWriter out;
  if (const auto* const box = std::get_if<BoxRegion>(&region)) {
    out.put(uint8_t{0}).putPose(box->T_W_B).putVector(box->size_m);
  } else {
    const auto& ball = std::get<SphereRegion>(region);
    out.put(uint8_t{1}).putVector(ball.center_W).put(ball.radius_m);
  }
  return plain(kClear, out.bytes);
}

Region readRegion(const Bytes& content) {
  ByteReader in(content);
  if (in.take<uint8_t>() == 0) {
    BoxRegion box;
    box.T_W_B = in.takePose();
    box.size_m = in.takeVector();
    return box;
  }
  SphereRegion ball;
  ball.center_W = in.takeVector();
  ball.radius_m = in.take<double>();
  return ball;
}

Bytes encodeLevel(const Eigen::Isometry3d& T_W_M) {
  ByteWriter out;
  return plain(kLevel, out.putPose(T_W_M).bytes);
}

Eigen::Isometry3d readLevel(const Bytes& content) { return ByteReader(content).takePose(); }

Bytes encode(const Correction& correction) {
  ByteWriter out;
  out.put(correction.before);
  for (const StampedPose& pose : correction.poses) out.put(pose.stamp_s).putPose(pose.T_W_C);
  return encodeRecord(kCorrection, kZstd, out.bytes.data(), out.bytes.size());
}

Correction readCorrection(const Bytes& content) {
  ByteReader in(content);
  Correction correction;
  correction.before = in.take<uint64_t>();
  while (in.left() > 0) {
    const auto stamp_s = in.take<double>();
    correction.poses.push_back({stamp_s, in.takePose()});
  }
  return correction;
}

}  // namespace journal
}  // namespace dtsdf
