#include "dtsdf_mapping/place_search.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "level/frame_points.h"
#include "poses/between.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3f;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;

/// Maximum number of standpoints (positions at which a camera is tried). Larger maps get larger
/// cells.
constexpr double kMaxStandpoints = 200000.0;

/// Edge of a cell, in voxels. An alignment can correct a pose that is off by one cell.
constexpr double kCell_voxels = 3.0;

/// Distance between standpoints, in cells.
constexpr double kStep_cells = 4.0;

/// How far outside the mapped blocks a camera may be, in cells.
constexpr int kMargin_cells = 16;

/// Number of evenly spread orientations, some twenty degrees apart.
constexpr int kOrientations = 2048;

/// Number of image points that are compared at a standpoint, and maximum number for fitting a pose.
constexpr int kMatchedPoints = 64, kFitPoints = 512;

/// Maximum number of poses in each of three steps: fitting to the coarse map, aligning to the map,
/// and rendering the map.
constexpr int kMovedPoses = 5000, kAlignedPoses = 224, kRenderedPoses = 48;

/// A pose is accepted if enough of its matched points are inliers and at least the fraction
/// kPlaceShare of the image matches the map. It is ambiguous if the mismatching fraction of the
/// image at another place is less than kClearlyMore times the fraction at the pose, plus
/// kClearlyMoreShare.
constexpr double kPlaceShare = 0.7, kClearlyMore = 1.5, kClearlyMoreShare = 0.01;

/// Larger depths are too noisy to use.
constexpr float kMaxDepth_m = 10.0f;

/// Distances to the nearest surface are clamped to this, in cells.
constexpr float kFarthest_cells = 64.0f;

/// The rays from a standpoint pass through the faces of a cube: kFaceSide x kFaceSide rays per
/// face.
constexpr int kFaceSide = 14, kRays = 6 * kFaceSide * kFaceSide;

/// Index of the ray nearest to a direction.
int rayOf(const Vector3f& way) {
  int axis = 0;
  way.cwiseAbs().maxCoeff(&axis);
  const float length = std::abs(way[axis]);
  const auto cell = [&](float along) {
    const int at = static_cast<int>(0.5f * (along / length + 1.0f) * kFaceSide);
    return std::min(at, kFaceSide - 1);
  };
  const int face = 2 * axis + (way[axis] < 0.0f ? 1 : 0);
  return (face * kFaceSide + cell(way[(axis + 1) % 3])) * kFaceSide + cell(way[(axis + 2) % 3]);
}

Vector3f directionOfRay(int ray) {
  const auto along = [](int cell) {
    return 2.0f * (static_cast<float>(cell) + 0.5f) / kFaceSide - 1.0f;
  };
  const int face = ray / (kFaceSide * kFaceSide), axis = face / 2;
  Vector3f way;
  way[axis] = face % 2 == 0 ? 1.0f : -1.0f;
  way[(axis + 1) % 3] = along(ray / kFaceSide % kFaceSide);
  way[(axis + 2) % 3] = along(ray % kFaceSide);
  return way.normalized();
}

/// Orientation i (Alexa, "Super-Fibonacci Spirals", CVPR 2022).
Matrix3f orientation(int i) {
  constexpr double kPi = 3.14159265358979323846, kPhi = 1.4142135623730951,
                   kPsi = 1.533751168755204288;
  const double s = i + 0.5, t = s / kOrientations, d = 2.0 * kPi * s;
  const double r = std::sqrt(t), R = std::sqrt(1.0 - t);
  const Eigen::Quaterniond q(R * std::cos(d / kPsi), r * std::sin(d / kPhi), r * std::cos(d / kPhi),
                             R * std::sin(d / kPsi));
  return q.normalized().toRotationMatrix().cast<float>();
}

/// A distance along a ray on a logarithmic scale with 16 steps per doubling, at most 253. 254 and
/// 255 have special meanings.
using Octaves = uint8_t;
constexpr Octaves kNothing = 255, kBackSide = 254;

Octaves octavesOf(float distance_cells) {
  const float octaves = 16.0f * std::log2(std::max(distance_cells, 1.0f));
  return static_cast<Octaves>(std::min(octaves, 253.0f));
}

/// The score of an image point at a standpoint, from its distance in the map and its measured
/// distance.
int agreement(Octaves in_map, Octaves measured) {
  if (in_map == kNothing) return 0;
  if (in_map == kBackSide) return -4;
  const int apart = in_map - measured;
  if (apart < -6) return -4;  // the measured point lies behind the surface
  if (apart > 6) return -2;
  return std::abs(apart) <= 3 ? 4 : 2;
}

/// Whether the image is valid and large enough for a search.
bool isImage(const DepthFrame& frame) {
  const size_t pixel = frame.encoding == DepthEncoding::kFloat32 ? sizeof(float) : sizeof(uint16_t);
  const Intrinsics& K = frame.intrinsics;
  return frame.data != nullptr && frame.width >= 16 && frame.height >= 16 &&
         frame.row_bytes >= static_cast<size_t>(frame.width) * pixel && K.fx > 0.0f &&
         K.fy > 0.0f && std::isfinite(K.fx + K.fy + K.cx + K.cy);
}

/// Points of the image, in cells, in the camera's optical frame. For any n, the first n are spread
/// over the whole image. Skips depth edges.
std::vector<Vector3f> imagePoints(const DepthFrame& frame, double cell_m) {
  const Intrinsics& K = frame.intrinsics;
  const int aside = std::max(1, frame.width / 160);
  std::vector<Vector3f> points;
  constexpr uint32_t kMaxTries = 4 * kFitPoints;
  for (uint32_t i = 0; i < kMaxTries && points.size() < kFitPoints; ++i) {
    // The generalised golden ratio in two dimensions spreads the points evenly.
    const double x = std::fmod(0.5 + 0.7548776662466927 * i, 1.0);
    const double y = std::fmod(0.5 + 0.5698402909980532 * i, 1.0);
    const int u = aside + static_cast<int>(x * (frame.width - 2 * aside));
    const int v = aside + static_cast<int>(y * (frame.height - 2 * aside));
    if (u < aside || v < aside || u + aside >= frame.width || v + aside >= frame.height) continue;
    const auto at = [&](int du, int dv) {
      return static_cast<float>(depthAt(frame, u + du * aside, v + dv * aside));
    };
    const float z = at(0, 0);
    const auto [least, most] = std::minmax({z, at(-1, 0), at(1, 0), at(0, -1), at(0, 1)});
    if (!(least > 0.0f) || most > kMaxDepth_m || most - least > 0.1f * most) continue;
    const Vector3f p((static_cast<float>(u) - K.cx) * z / K.fx,
                     (static_cast<float>(v) - K.cy) * z / K.fy, z);
    points.push_back(p / static_cast<float>(cell_m));
  }
  return points;
}

/// Gradient of the distance at a voxel, from its measured neighbours in the same array.
Vector3f slopeIn(const uint64_t* array, const Vector3i& at) {
  Vector3f slope = Vector3f::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const int stride = 1 << 3 * axis, i = at.x() + 8 * (at.y() + 8 * at.z());
    const int before = at[axis] > 0 ? i - stride : i, after = at[axis] < 7 ? i + stride : i;
    const VoxelValues a = decodeVoxel(array[before]), b = decodeVoxel(array[after]);
    if (!(a.weight > 0.0f) || !(b.weight > 0.0f)) continue;
    slope[axis] =
        (b.distance_voxels - a.distance_voxels) * (after - before == stride ? 1.0f : 0.5f);
  }
  return slope;
}

/// The larger of the shift between two poses, and the shift that their relative rotation causes at
/// a distance of `lever`.
double apart(const Isometry3d& a, const Isometry3d& b, double lever) {
  const double turn = Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
  return std::max((a.translation() - b.translation()).norm(), lever * turn);
}

/// The fraction of an image's depths that match the map rendered from a pose.
double matchingShare(Mapper& mapper, const DepthFrame& frame, const Isometry3d& T_W_C,
                     float tolerance_m, RenderedView& view) {
  const int step = std::max(1, frame.width / 160);
  const auto scale = static_cast<float>(step);
  const Intrinsics& K = frame.intrinsics;
  const RenderCamera camera{frame.width / step,
                            frame.height / step,
                            {K.fx / scale, K.fy / scale, K.cx / scale, K.cy / scale}};
  mapper.render(camera, T_W_C, view);
  size_t measured = 0, same = 0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const auto depth_m = static_cast<float>(depthAt(frame, u * step, v * step));
      if (!(depth_m > 0.0f) || depth_m > kMaxDepth_m) continue;
      const float shown_m =
          view.depth_m[static_cast<size_t>(v) * static_cast<size_t>(camera.width) +
                       static_cast<size_t>(u)];
      ++measured;
      same += std::abs(shown_m - depth_m) < std::max(tolerance_m, 0.03f * depth_m) ? 1 : 0;
    }
  }
  return measured == 0 ? 0.0 : static_cast<double>(same) / static_cast<double>(measured);
}

/// Another pose that also fits, if the image does not constrain the position, as along a corridor;
/// otherwise none.
std::optional<Isometry3d> slidPose(const Alignment& alignment) {
  constexpr double kHeld_m = 0.05;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(
      alignment.covariance.topLeftCorner<3, 3>());
  const double sigma_m = std::sqrt(std::max(0.0, axes.eigenvalues()(2)));
  if (sigma_m < kHeld_m) return std::nullopt;
  Isometry3d T_W_C = alignment.T_W_C;
  T_W_C.translation() += sigma_m * axes.eigenvectors().col(2);
  return T_W_C;
}

/// Alignments of an image, sorted by the fraction of its depths that match the map.
using Matches = std::multimap<double, const Alignment*, std::greater<>>;

/// Chooses the place that matches the image best, and reports another place if it matches about as
/// well.
FoundPlace choose(const Matches& matches, double same_place_m) {
  const auto& [best_share, first] = *matches.begin();
  const Isometry3d there = first->T_W_C;
  const Alignment* best = first;
  FoundPlace found;
  for (const auto& [share, other] : matches) {
    constexpr double kSame = 0.01, kLever_m = 1.5;
    const bool is_there = apart(there, other->T_W_C, kLever_m) < same_place_m;
    if (is_there && share > best_share - kSame && explainedBy(*other) > explainedBy(*best)) {
      best = other;  // at the same place, the better alignment is used
    }
    const double most = kClearlyMore * (1.0 - best_share) + kClearlyMoreShare;
    if (!is_there && !found.other_T_W_C && 1.0 - share < most) found.other_T_W_C = other->T_W_C;
  }
  if (!found.other_T_W_C) found.other_T_W_C = slidPose(*best);
  found.alignment = *best;
  found.explained_share = best_share;
  if (!best->is_held || best_share < kPlaceShare) {
    found.alignment.status = AlignmentStatus::kMisfit;
    found.other_T_W_C.reset();
  } else if (found.other_T_W_C) {
    found.alignment.status = AlignmentStatus::kAmbiguous;
  }
  return found;
}

/// The map in coarse cells.
struct CoarseMap {
  /// The surface in a cell: the plane through the mean of its points. The normal is 0 if the points
  /// face different ways.
  struct CellSurface {
    Vector3f middle = Vector3f::Zero(), normal = Vector3f::Zero();
    float points = 0.0f;
    uint8_t faces = 0;  ///< Directions that the surface faces, one bit each.
  };

  /// The orientations to try, the rays through the image's first points at each orientation, and
  /// the score of each point for every possible distance in the map.
  struct RayTable {
    size_t points = 0;
    std::vector<Matrix3f> R_W_C;
    std::vector<uint16_t> rays;  ///< Ray of each point, grouped by orientation.
    std::vector<std::array<int8_t, 256>> scores;
  };

  double voxel_m = 0.0, cell_m = 0.0;
  int threads = 0;
  Vector3i first = Vector3i::Zero(), size = Vector3i::Zero();  ///< In cells, including the margin.
  std::vector<int32_t> surface_of;  ///< Index of each cell's surface; negative: none.
  std::vector<CellSurface> surfaces;
  std::vector<float> distance;      ///< From each cell to the nearest surface cell, in cells.
  std::vector<uint8_t> free_steps;  ///< `distance`, rounded down.

  struct Candidate {
    Isometry3d T_W_C = Isometry3d::Identity();  ///< In cells.
    float score = -std::numeric_limits<float>::infinity();
  };
  using BestMatches = std::array<Candidate, 3>;  ///< The candidates kept for a standpoint.

  static bool isBetter(const Candidate& a, const Candidate& b) { return a.score > b.score; }

  size_t indexOf(const Vector3i& cell) const {
    return (static_cast<size_t>(cell.z()) * static_cast<size_t>(size.y()) +
            static_cast<size_t>(cell.y())) *
               static_cast<size_t>(size.x()) +
           static_cast<size_t>(cell.x());
  }
  bool holds(const Vector3i& cell) const {
    return (cell.array() >= 0).all() && (cell.array() < size.array()).all();
  }

  void read(Mapper& mapper);
  void addBlocks(const MapContents& part, bool directional);
  void addPoint(const Vector3d& p_voxels, const Vector3f& normal, unsigned faces);
  void measureDistances();
  float distanceAt(const Vector3f& p, Vector3f& gradient) const;
  bool castRays(const Vector3f& from, std::array<Octaves, kRays>& view) const;
  float castRay(const Vector3f& from, const Vector3f& way, Octaves& seen) const;
  float scoreOfPose(const Isometry3d& T_W_C, const std::vector<Vector3f>& points) const;
  bool isSeenFrom(const Vector3f& way, uint8_t facing) const;
  static RayTable makeRayTable(const std::vector<Vector3f>& points);
  void matchFrom(const Vector3f& from, const RayTable& table, BestMatches& best) const;
  std::vector<Candidate> matchAround(const std::vector<Vector3f>& points) const;
  std::vector<Isometry3d> candidatePoses(const std::vector<Vector3f>& points) const;
  void refinePose(Candidate& candidate, const std::vector<Vector3f>& points) const;
};

void CoarseMap::read(Mapper& mapper) {
  MapContents outline = mapper.outline();
  if (outline.blocks.empty()) return;
  const MapperParams params = withSettingsOf(outline, MapperParams());
  voxel_m = params.map.voxel_size_m;
  cell_m = kCell_voxels * voxel_m;
  Vector3i low = Vector3i::Constant(std::numeric_limits<int>::max()), high = -low;
  for (const MapBlock& block : outline.blocks) {
    const Vector3i key(block.key.x, block.key.y, block.key.z);
    low = low.cwiseMin(key);
    high = high.cwiseMax(key);
  }
  const Eigen::Array3d extent_m =
      (high - low + Vector3i::Ones()).cast<double>() * (kBlockSide * voxel_m);
  const auto standpoints = [&] {
    return ((extent_m + 2.0 * kMargin_cells * cell_m) / (kStep_cells * cell_m)).prod();
  };
  while (standpoints() > kMaxStandpoints) cell_m *= 1.1;
  const double cells_per_block = kBlockSide * voxel_m / cell_m;
  first = (low.cast<double>() * cells_per_block).array().floor().cast<int>() - kMargin_cells;
  size = ((high + Vector3i::Ones()).cast<double>() * cells_per_block).array().ceil().cast<int>() +
         kMargin_cells;
  size -= first;
  surface_of.assign(
      static_cast<size_t>(size.x()) * static_cast<size_t>(size.y()) * static_cast<size_t>(size.z()),
      -1);
  constexpr size_t kBlocksAtOnce = 4096;
  for (size_t i = 0; i < outline.blocks.size(); i += kBlocksAtOnce) {
    const size_t end = std::min(i + kBlocksAtOnce, outline.blocks.size());
    addBlocks(mapper.part({outline.blocks.begin() + static_cast<std::ptrdiff_t>(i),
                           outline.blocks.begin() + static_cast<std::ptrdiff_t>(end)}),
              params.map.directional);
  }
  for (CellSurface& surface : surfaces) {
    constexpr float kSameWay = 0.9f;
    surface.middle /= surface.points;
    const float length = surface.normal.norm();
    surface.normal =
        length > kSameWay * surface.points ? Vector3f(surface.normal / length) : Vector3f::Zero();
  }
  measureDistances();
}

void CoarseMap::addBlocks(const MapContents& part, bool directional) {
  const uint64_t* words = part.voxels.data();
  for (const MapBlock& block : part.blocks) {
    const Vector3d first_voxel = kBlockSide * Vector3d(block.key.x, block.key.y, block.key.z);
    for (unsigned d = 0; d < 6; ++d) {
      if ((block.directions >> d & 1u) == 0) continue;
      const uint64_t* const array = std::exchange(words, words + 512);
      for (int i = 0; i < 512; ++i) {
        constexpr float kNear_voxels = 0.75f, kMinSlope = 0.3f;
        const VoxelValues voxel = decodeVoxel(array[i]);
        if (!(voxel.weight > 0.0f) || voxel.evidence <= 0) continue;
        if (std::abs(voxel.distance_voxels) > kNear_voxels) continue;
        const Vector3i at(i & 7, i >> 3 & 7, i >> 6);
        const Vector3f slope = slopeIn(array, at);
        if (!(slope.norm() > kMinSlope)) continue;
        const Vector3f normal = slope.normalized();
        const Vector3f off = at.cast<float>() - voxel.distance_voxels * normal;
        addPoint(first_voxel + off.cast<double>(), normal, directional ? 1u << d : 63u);
      }
    }
  }
}

/// Adds a surface point, given in voxels.
void CoarseMap::addPoint(const Vector3d& p_voxels, const Vector3f& normal, unsigned faces) {
  const Vector3f p = (p_voxels * (voxel_m / cell_m) - first.cast<double>()).cast<float>();
  const Vector3i cell = p.array().floor().cast<int>();
  if (!holds(cell)) return;
  int32_t& number = surface_of[indexOf(cell)];
  if (number < 0) {
    number = static_cast<int32_t>(surfaces.size());
    surfaces.emplace_back();
  }
  CellSurface& surface = surfaces[static_cast<size_t>(number)];
  surface.middle += p;
  surface.normal += normal;
  surface.points += 1.0f;
  surface.faces |= static_cast<uint8_t>(faces);
}

/// Minimises squared distances along x, then y, then z (Saito and Toriwaki, Pattern Recognition 27,
/// 1994).
void CoarseMap::measureDistances() {
  distance.resize(surface_of.size());
  for (size_t i = 0; i < distance.size(); ++i) {
    distance[i] = surface_of[i] >= 0 ? 0.0f : kFarthest_cells * kFarthest_cells;
  }
  size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<size_t>(size[axis]);
    const auto workOutLine = [&](size_t number, std::vector<float>& from) {
      const size_t begin = number % stride + number / stride * stride * n;
      from.resize(n);
      for (size_t i = 0; i < n; ++i) from[i] = distance[begin + i * stride];
      for (size_t i = 0; i < n; ++i) {
        float least = from[i];
        for (size_t k = 1; static_cast<float>(k * k) < least; ++k) {
          const auto square = static_cast<float>(k * k);
          if (k <= i) least = std::min(least, from[i - k] + square);
          if (i + k < n) least = std::min(least, from[i + k] + square);
        }
        distance[begin + i * stride] = least;
      }
    };
    parallelFor<std::vector<float>, 64>(distance.size() / n, threads, workOutLine);
    stride *= n;
  }
  free_steps.resize(distance.size());
  for (size_t i = 0; i < distance.size(); ++i) {
    distance[i] = std::sqrt(distance[i]);
    free_steps[i] = static_cast<uint8_t>(distance[i]);
  }
}

/// Interpolates between the centres of cells; beyond the outermost centres, returns
/// kFarthest_cells.
float CoarseMap::distanceAt(const Vector3f& p, Vector3f& gradient) const {
  const Vector3f q = p.array() - 0.5f;
  const Vector3i cell = q.array().floor().cast<int>();
  if (!((cell.array() >= 0).all() && (cell.array() + 1 < size.array()).all())) {
    gradient.setZero();
    return kFarthest_cells;
  }
  const Vector3f f = q - cell.cast<float>();
  const size_t i = indexOf(cell), y = static_cast<size_t>(size.x()),
               z = y * static_cast<size_t>(size.y());
  const float* const d = distance.data() + i;
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const float x00 = mix(d[0], d[1], f.x()), x10 = mix(d[y], d[y + 1], f.x()),
              x01 = mix(d[z], d[z + 1], f.x()), x11 = mix(d[z + y], d[z + y + 1], f.x());
  const float y0 = mix(x00, x10, f.y()), y1 = mix(x01, x11, f.y());
  gradient.z() = y1 - y0;
  gradient.y() = mix(x10 - x00, x11 - x01, f.z());
  gradient.x() = mix(mix(d[1] - d[0], d[y + 1] - d[y], f.y()),
                     mix(d[z + 1] - d[z], d[z + y + 1] - d[z + y], f.y()), f.z());
  return mix(y0, y1, f.z());
}

/// Whether a ray hits the front of a surface that faces these directions.
bool CoarseMap::isSeenFrom(const Vector3f& way, uint8_t facing) const {
  for (int axis = 0; axis < 3; ++axis) {
    if ((facing >> (2 * axis) & 1) != 0 && way[axis] < 0.1f) return true;
    if ((facing >> (2 * axis + 1) & 1) != 0 && way[axis] > -0.1f) return true;
  }
  return false;
}

/// Sphere tracing: each step is at most the distance to the nearest surface. @return the distance
/// to the surface that the ray hits, in cells; 0 if there is none.
float CoarseMap::castRay(const Vector3f& from, const Vector3f& way, Octaves& seen) const {
  constexpr float kShortest = 0.7f;
  float along = 0.0f;
  for (int step = 0; step < 256; ++step) {
    const Vector3f p = from + along * way;
    const Vector3i cell = p.array().floor().cast<int>();
    if (!holds(cell)) break;
    const size_t i = indexOf(cell);
    const int free = free_steps[i];
    if (free > 0) {
      along += std::max(kShortest, static_cast<float>(free) - 0.8f);
      continue;
    }
    const CellSurface& surface = surfaces[static_cast<size_t>(surface_of[i])];
    const float facing = way.dot(surface.normal);
    if (surface.normal.isZero()) {
      seen = isSeenFrom(way, surface.faces) ? octavesOf(along) : kBackSide;
      return along;
    }
    const float to_plane = surface.normal.dot(surface.middle - from) / facing;
    if (std::abs(facing) > 0.02f && std::abs(to_plane - along) < 1.0f) {
      seen = facing < 0.0f ? octavesOf(to_plane) : kBackSide;
      return to_plane;
    }
    along += kShortest;
  }
  seen = kNothing;
  return 0.0f;
}

/// Casts all rays from a standpoint. @return false if they hit hardly anything, or mostly the backs
/// of surfaces, as from outside a building.
bool CoarseMap::castRays(const Vector3f& from, std::array<Octaves, kRays>& view) const {
  static const std::vector<Vector3f> ways = [] {
    std::vector<Vector3f> all(kRays);
    for (int i = 0; i < kRays; ++i) all[static_cast<size_t>(i)] = directionOfRay(i);
    return all;
  }();
  constexpr size_t kParts = 7;  // the first part, with rays all around, rules out most standpoints
  static_assert(kRays % kParts == 0, "");
  size_t seen = 0, backs = 0;
  for (size_t part = 0; part < kParts; ++part) {
    for (size_t i = part; i < kRays; i += kParts) {
      castRay(from, ways[i], view[i]);
      (view[i] == kBackSide ? backs : seen) += view[i] != kNothing ? 1 : 0;
    }
    if (part == 0 && (seen < kRays / kParts / 16 || backs > seen)) return false;
  }
  return true;
}

CoarseMap::RayTable CoarseMap::makeRayTable(const std::vector<Vector3f>& points) {
  RayTable table;
  table.points = std::min<size_t>(points.size(), kMatchedPoints);
  table.scores.resize(table.points);
  for (size_t k = 0; k < table.points; ++k) {
    const Octaves measured = octavesOf(points[k].norm());
    for (size_t d = 0; d < 256; ++d) {
      table.scores[k][d] = static_cast<int8_t>(agreement(static_cast<Octaves>(d), measured));
    }
  }
  for (int number = 0; number < kOrientations; ++number) {
    table.R_W_C.push_back(orientation(number));
    for (size_t k = 0; k < table.points; ++k) {
      table.rays.push_back(static_cast<uint16_t>(rayOf(table.R_W_C.back() * points[k])));
    }
  }
  return table;
}

/// Finds the best orientations at a standpoint, best first.
void CoarseMap::matchFrom(const Vector3f& from, const RayTable& table, BestMatches& best) const {
  const Vector3i cell = from.array().floor().cast<int>();
  constexpr float kMinRoom_cells = 1.5f;
  std::array<Octaves, kRays> view;
  if (!holds(cell) || distance[indexOf(cell)] < kMinRoom_cells || !castRays(from, view)) return;
  for (size_t i = 0; i < table.R_W_C.size(); ++i) {
    const uint16_t* const ray = table.rays.data() + i * table.points;
    constexpr size_t kFirstPoints = 16;
    constexpr int kPromising = 8;  // kFirstPoints score at most 64
    int score = 0;
    for (size_t k = 0; k < kFirstPoints; ++k) score += table.scores[k][view[ray[k]]];
    if (score < kPromising) continue;
    for (size_t k = kFirstPoints; k < table.points; ++k) score += table.scores[k][view[ray[k]]];
    size_t place = best.size();
    while (place > 0 && static_cast<float>(score) > best[place - 1].score) --place;
    if (place == best.size()) continue;
    std::move_backward(best.begin() + place, best.end() - 1, best.end());
    best[place].score = static_cast<float>(score);
    best[place].T_W_C.linear() = table.R_W_C[i].cast<double>();
    best[place].T_W_C.translation() = from.cast<double>();
  }
}

/// The best poses over all standpoints.
std::vector<CoarseMap::Candidate> CoarseMap::matchAround(
    const std::vector<Vector3f>& points) const {
  const RayTable table = makeRayTable(points);
  const Vector3i steps = (size.cast<double>() / kStep_cells).array().ceil().cast<int>();
  const auto nx = static_cast<size_t>(steps.x()), ny = static_cast<size_t>(steps.y());
  std::vector<BestMatches> kept(nx * ny * static_cast<size_t>(steps.z()));
  parallelFor<int, 16>(kept.size(), threads, [&](size_t number, int&) {
    const Vector3f at(static_cast<float>(number % nx), static_cast<float>(number / nx % ny),
                      static_cast<float>(number / nx / ny));
    matchFrom((at.array() + 0.5f) * static_cast<float>(kStep_cells), table, kept[number]);
  });
  std::vector<Candidate> best;
  for (const BestMatches& from : kept) {
    for (const Candidate& candidate : from) {
      if (candidate.score > 0.0f) best.push_back(candidate);
    }
  }
  std::stable_sort(best.begin(), best.end(), isBetter);
  best.resize(std::min<size_t>(best.size(), kMovedPoses));
  return best;
}

/// Fits a pose by Gauss-Newton on the coarse distances, with a shrinking cutoff, and scores it with
/// scoreOfPose().
void CoarseMap::refinePose(Candidate& candidate, const std::vector<Vector3f>& points) const {
  Isometry3d& T = candidate.T_W_C;
  constexpr int kSteps = 12;
  for (int step = 0; step < kSteps; ++step) {
    const float cutoff = std::max(1.2f, 5.0f * std::pow(0.8f, static_cast<float>(step)));
    Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
    const Matrix3f R = T.linear().cast<float>();
    const Vector3f t = T.translation().cast<float>();
    for (const Vector3f& point : points) {
      const Vector3f lever = R * point;
      Vector3f g;
      const float d = distanceAt(lever + t, g);
      if (!(d < cutoff)) continue;
      const float share = d / cutoff, weight = (1.0f - share * share) * (1.0f - share * share);
      Eigen::Matrix<double, 6, 1> J;
      J << lever.cross(g).cast<double>(), g.cast<double>();
      A += weight * J * J.transpose();
      b += weight * static_cast<double>(d) * J;
    }
    const Eigen::Matrix<double, 6, 1> change = A.ldlt().solve(-b);
    if (!change.allFinite()) break;
    const double angle = change.head<3>().norm();
    if (angle > 0.0) {
      T.linear() = (Eigen::AngleAxisd(angle, change.head<3>() / angle) * T.linear()).eval();
    }
    T.translation() += change.tail<3>();
  }
  T.linear() = Eigen::Quaterniond(T.linear()).normalized().toRotationMatrix();
  candidate.score = scoreOfPose(T, points);
}

/// The score of a pose, computed from the image's points; at most 1.
float CoarseMap::scoreOfPose(const Isometry3d& T_W_C, const std::vector<Vector3f>& points) const {
  const Matrix3f R = T_W_C.linear().cast<float>();
  const Vector3f t = T_W_C.translation().cast<float>();
  float sum = 0.0f;
  for (const Vector3f& point : points) {
    const float measured = point.norm();
    Octaves octaves = kNothing;
    const float shown = castRay(t, R * point / measured, octaves);
    if (octaves == kNothing) continue;
    const float off = shown - measured, width = std::max(1.5f, 0.06f * measured);
    if (octaves == kBackSide || off < -2.0f * width) {
      sum -= 0.5f;  // only half a point, since cells are coarse
    } else if (std::abs(off) < width) {
      sum += 1.0f;
    }
  }
  return sum / static_cast<float>(points.size());
}

/// The distinct poses that best fit the coarse map, in W.
std::vector<Isometry3d> CoarseMap::candidatePoses(const std::vector<Vector3f>& points) const {
  std::vector<Candidate> candidates = matchAround(points);
  parallelFor<int, 8>(candidates.size(), threads,
                      [&](size_t i, int&) { refinePose(candidates[i], points); });
  std::stable_sort(candidates.begin(), candidates.end(), isBetter);
  std::vector<Isometry3d> in_cells, places;
  for (const Candidate& candidate : candidates) {
    constexpr double kApart_cells = 3.0, kLever_cells = 20.0;
    const auto is_near = [&](const Isometry3d& other) {
      return apart(candidate.T_W_C, other, kLever_cells) < kApart_cells;
    };
    if (places.size() >= kAlignedPoses) break;
    if (std::any_of(in_cells.begin(), in_cells.end(), is_near)) continue;
    in_cells.push_back(candidate.T_W_C);
    places.push_back(candidate.T_W_C);
    places.back().translation() = cell_m * (candidate.T_W_C.translation() + first.cast<double>());
  }
  return places;
}

}  // namespace

FoundPlace findPlace(Mapper& mapper, const DepthFrame& frame, int threads) {
  FoundPlace found;
  found.alignment.T_W_C = frame.T_W_C;
  if (!isImage(frame)) return found;
  CoarseMap map;
  map.threads = threads;
  map.read(mapper);
  if (map.surfaces.empty()) return found;
  const std::vector<Vector3f> points = imagePoints(frame, map.cell_m);
  if (points.size() < kMatchedPoints) return found;
  std::vector<Alignment> aligned;
  DepthFrame at = frame;
  PosePrior prior;
  prior.sigma_m = 6.0 * map.cell_m;
  prior.sigma_rad = 0.15;
  for (const Isometry3d& place : map.candidatePoses(points)) {
    at.T_W_C = place;
    aligned.push_back(mapper.align(at, prior));
  }
  std::stable_sort(aligned.begin(), aligned.end(), [](const Alignment& a, const Alignment& b) {
    return explainedBy(a) > explainedBy(b);
  });
  Matches matches;
  RenderedView view;
  for (const Alignment& alignment : aligned) {
    if (matches.size() >= kRenderedPoses || !(explainedBy(alignment) > 0.0)) break;
    const float tolerance_m = 2.5f * static_cast<float>(map.voxel_m);
    matches.emplace(matchingShare(mapper, frame, alignment.T_W_C, tolerance_m, view), &alignment);
  }
  if (matches.empty()) return found;
  return choose(matches, std::max(3.0 * map.cell_m, 0.25));
}

}  // namespace dtsdf
