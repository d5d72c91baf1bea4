#include "cpu/facing_points.h"

#include <algorithm>
#include <cstring>

#include "cpu/lanes.h"
#include "cpu/widest_vectors.h"

namespace dtsdf {
namespace {

using LanePoints = SurfacePointOf<LaneFloats>;
using LaneColours = RgbOf<LaneFloats>;

LaneInts clampedTo(const LaneInts& a, int32_t count) {
  const LaneInts least(0), most(count - 1);
  const LaneInts not_below = select(least > a, least, a);
  return select(not_below > most, most, not_below);
}

LaneFloats byteOf(const LaneInts& pixels, int number) {
  constexpr bool kLittle = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
  return toFloats(LaneInts(pixels.v >> (kLittle ? 8 * number : 24 - 8 * number) & 255));
}

}  // namespace

/// For colourAt().
static LaneColours rgbAt(const ColourImage& image, const ColourLevel& level, const LaneInts& u,
                         const LaneInts& v) {
  const LaneInts places =
      clampedTo(v, level.height) * LaneInts(level.width) + clampedTo(u, level.width);
  const ColourPixel* const first = image.pixels + level.first;
  LaneInts pixels;
  for (int k = 0; k < kLanes; ++k) {
    int32_t pixel;
    std::memcpy(&pixel, first + places.v[k], sizeof(pixel));
    pixels.v[k] = pixel;
  }
  return {byteOf(pixels, 0), byteOf(pixels, 1), byteOf(pixels, 2)};
}

namespace {

/// Each from its level.
LaneColours coloursAt(const ColourImage& image, const LaneInts& levels, const LanePoints& points) {
  LaneColours colours = {};
  for (int level = 0; level < kColourLevels; ++level) {
    const LaneInts is_here = levels == LaneInts(level);
    if (!any(is_here)) continue;
    const LaneColours of_level = colourAt(image, level, points.u, points.v);
    colours = {select(is_here, of_level.red, colours.red),
               select(is_here, of_level.green, colours.green),
               select(is_here, of_level.blue, colours.blue)};
  }
  return colours;
}

/// As roundColour() of each.
void storeRounded(const LaneFloats& channel, int32_t* values) {
  cutOff(channel + LaneFloats(0.5f)).store(values);
}

}  // namespace

void FacingPoints::add(const SurfacePoints& points, int direction) {
  const size_t most = count_ + static_cast<size_t>(points.count()) + 1;  // one is written in vain
  if (groups_.size() * kGroup < most) groups_.resize(most / kGroup + 1);
  size_t count = count_;
  for (int i = 0; i < points.count(); ++i) {
    const SurfacePoint point = points.point(i);
    Group& group = groups_[count / kGroup];
    const size_t k = count % kGroup;
    group.depth_m[k] = point.depth_m;
    group.cosine[k] = point.cosine;
    group.u[k] = point.u;
    group.v[k] = point.v;
    group.inverse_depth[k] = point.plane.inverse_depth;
    group.per_u[k] = point.plane.per_u;
    group.per_v[k] = point.plane.per_v;
    group.voxel[k] = static_cast<uint16_t>(direction * kVoxelsPerBlock + points.index(i));
    count += static_cast<size_t>(point.cosine > 0.0f);
  }
  count_ = count;
}

void FacingPoints::sample(const ColourSensing& sensing, VoxelSamples& samples) const {
  static_assert(kGroup == kLanes, "a group fills the lanes");
  const PointView& view = sensing.view;
  samples.samples_.makeRoom(count_ + 1);
  size_t sampled = 0;
  withWidestVectors([&] {
    for (size_t first = 0; first < count_; first += kGroup) {
      const Group& group = groups_[first / kGroup];
      const LanePoints points{LaneFloats::load(group.depth_m),
                              LaneFloats::load(group.cosine),
                              LaneFloats::load(group.u),
                              LaneFloats::load(group.v),
                              {LaneFloats::load(group.inverse_depth), LaneFloats::load(group.per_u),
                               LaneFloats::load(group.per_v)}};
      const LaneFloats share = visibilityOf(view, sensing.hiding, points);
      if (!any(share > LaneFloats(0.0f))) continue;
      const LaneColours colours =
          coloursAt(sensing.image, levelOfWidth(sampleWidth(view, points)), points);
      int32_t red[kLanes], green[kLanes], blue[kLanes];
      float weight[kLanes];
      storeRounded(colours.red, red);
      storeRounded(colours.green, green);
      storeRounded(colours.blue, blue);
      (share * viewWeight(view, points)).store(weight);
      const int count = static_cast<int>(std::min<size_t>(kGroup, count_ - first));
      for (int k = 0; k < count; ++k) {
        samples.samples_[sampled] = {group.voxel[k],
                                     {static_cast<uint8_t>(red[k]), static_cast<uint8_t>(green[k]),
                                      static_cast<uint8_t>(blue[k]), weight[k]}};
        sampled += static_cast<size_t>(weight[k] > 0.0f);
      }
    }
  });
  samples.count_ = sampled;
}

}  // namespace dtsdf
