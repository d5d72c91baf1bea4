#include <algorithm>
#include <cmath>
#include <iterator>

#include "scenes/cases.h"
#include "scenes/scene_map.h"

namespace dtsdf {
namespace {

using Eigen::Vector3d;

constexpr double kWallBehind_m = 0.6, kDistance_m = 0.5;
constexpr double kLength_m = 0.2, kThickness_m = 0.002;
constexpr double kSpacing_m = 0.08;  // between the centre lines of slats
constexpr double kPi = 3.14159265358979323846;

/// How slats are placed: rotated in the image plane, tilted in depth, and shifted along each axis
/// by a fraction of a voxel.
struct Stand {
  const char* name;
  double roll_deg, tilt_deg, off_voxels;
};

/// A slat and its frame S: x across it, y along it, and its front at z = 0, facing -z.
struct Slat {
  double width_m;
  Eigen::Isometry3d T_W_S;

  Box box() const {
    return {T_W_S * Eigen::Translation3d(0.0, 0.0, 0.5 * kThickness_m),
            0.5 * Vector3d(width_m, kLength_m, kThickness_m)};
  }
};

Slat makeSlat(double width_m, double across_m, const Stand& stand, double voxel_m) {
  const double roll = stand.roll_deg * kPi / 180.0, tilt = stand.tilt_deg * kPi / 180.0;
  Slat slat{width_m, Eigen::Isometry3d::Identity()};
  slat.T_W_S.translate(Vector3d::Constant(stand.off_voxels * voxel_m));
  slat.T_W_S.rotate(Eigen::AngleAxisd(roll, Vector3d::UnitZ()));
  slat.T_W_S.translate(Vector3d(across_m, 0.0, 0.0));
  slat.T_W_S.rotate(Eigen::AngleAxisd(tilt, Vector3d::UnitX()));
  return slat;
}

/// At the distance of the slats, a pixel is about 1 mm wide.
SceneCamera slatCamera() { return {320, 280, 525.0}; }

Surface watchSlats(const SceneSetup& setup, const std::vector<Slat>& slats) {
  Scene scene;
  scene.add(wallAt(kWallBehind_m + 0.0037));
  for (const Slat& slat : slats) scene.add(slat.box());
  SceneMap map(setup);
  map.watch(scene, slatCamera(), Vector3d(0.0, 0.0, -kDistance_m), 30, 0.015);
  return map.surface();
}

/// Mesh area of one slat, excluding its ends, in 1 mm bins along the slat.
class SlatMesh {
 public:
  SlatMesh(const Slat& slat, const Surface& surface) : slat_(slat) {
    const Eigen::Isometry3d T_S_W = slat.T_W_S.inverse();
    // Excludes the other slats, and the wall, which is more than 0.2 m away.
    const auto near = [&](const Vector3d& p) {
      const Vector3d p_S = T_S_W * p;
      return std::abs(p_S.x()) < 0.5 * kSpacing_m && std::abs(p_S.y()) < 0.6 * kLength_m &&
             std::abs(p_S.z()) < 0.2;
    };
    for (const FlatTriangle& t : refine(partOf(surface, near), 0.001)) {
      const double along_mm = 1000.0 * ((T_S_W * t.centroid()).y() + kInner_m);
      const int bin = static_cast<int>(std::floor(along_mm));
      if (bin >= 0 && bin < kBins) area_m2_[static_cast<size_t>(bin)] += t.area();
    }
  }

  /// Mesh area as a percentage of the area of the slat's front, both excluding the ends.
  double areaPercent() const { return 100.0 * sum() / (slat_.width_m * 0.001 * kBins); }
  double longestGap_mm() const {
    int run = 0, longest = 0;
    for (const double area : area_m2_) longest = std::max(longest, run = area > 0.0 ? 0 : run + 1);
    return longest;
  }
  bool isThere() const { return sum() > 0.0; }
  /// Area divided by length, over the bins that contain any area.
  double meanWidth_mm() const {
    const auto there =
        std::count_if(area_m2_.begin(), area_m2_.end(), [](double area) { return area > 0.0; });
    return 1.0e6 * sum() / static_cast<double>(there);
  }

 private:
  static constexpr double kInner_m = 0.4 * kLength_m;
  static constexpr int kBins = 160;  // each 1 mm long

  double sum() const {
    double total = 0.0;
    for (const double area : area_m2_) total += area;
    return total;
  }

  const Slat slat_;
  std::vector<double> area_m2_ = std::vector<double>(kBins, 0.0);
};

/// In the mesh, no slat may have a gap longer than 1 mm, or be wider than its true width or a
/// voxel, whichever is greater. With voxels of up to 10 mm, its area must also be correct.
std::vector<Figure> measureStand(const SceneSetup& setup, const Stand& stand) {
  std::vector<Slat> slats;
  const double widths_mm[] = {5.0, 10.0, 20.0};
  slats.reserve(std::size(widths_mm));
  for (int i = 0; i < 3; ++i) {
    slats.push_back(makeSlat(0.001 * widths_mm[i], (i - 1) * kSpacing_m, stand, setup.voxel()));
  }
  const Surface surface = watchSlats(setup, slats);
  std::vector<Figure> figures;
  const bool fine = setup.voxel() < 0.0101;
  for (int i = 0; i < 3; ++i) {
    const SlatMesh mesh(slats[static_cast<size_t>(i)], surface);
    const std::string of = ", " + std::to_string(static_cast<int>(widths_mm[i])) + " mm slat";
    const double widest_mm = std::max(widths_mm[i], 1000.0 * setup.voxel());
    figures.push_back(fine ? within("area" + of, 85.0, 115.0, "%", mesh.areaPercent())
                           : reported("area" + of, "%", mesh.areaPercent()));
    figures.push_back(atMost("longest gap" + of, 1.0, "mm", mesh.longestGap_mm()));
    if (!mesh.isThere()) continue;
    // The mesh is never perfectly flat, so its area slightly exceeds that of its outline.
    figures.push_back(atMost("mean width" + of, 1.02 * widest_mm, "mm", mesh.meanWidth_mm()));
  }
  return figures;
}

/// The back of a chair, with slats two voxels apart. The gaps between them must stay open.
std::vector<Figure> measureChair(const SceneSetup& setup, double width_m) {
  const double gap_m = 2.0 * setup.voxel(), step_m = width_m + gap_m;
  const int half = static_cast<int>(0.1 / step_m);
  const Stand upright{"upright", 0.0, 0.0, 0.43};
  std::vector<Slat> slats;
  for (int i = -half; i <= half; ++i) {
    slats.push_back(makeSlat(width_m, i * step_m, upright, setup.voxel()));
  }
  const Vector3d off = Vector3d::Constant(upright.off_voxels * setup.voxel());
  const Surface near =
      refine(partOf(watchSlats(setup, slats),
                    [&](const Vector3d& p) {
                      return std::abs(p.y() - off.y()) < 0.45 * kLength_m && p.z() < 0.2;
                    }),
             0.002);
  const double height_m = 0.8 * kLength_m;
  double in_gaps_m2 = 0.0, on_slats_m2 = 0.0;
  for (const FlatTriangle& t : near) {
    const Vector3d p = t.centroid() - off;
    const double across_m = std::abs(p.x() - step_m * std::round(p.x() / step_m));
    if (std::abs(p.y()) > 0.5 * height_m || std::abs(p.x()) > (half + 0.5) * step_m) continue;
    (across_m > 0.5 * width_m + 0.5 * setup.voxel() ? in_gaps_m2 : on_slats_m2) += t.area();
  }
  // Half a voxel next to each slat does not count as a gap.
  const double gaps_m2 = 2 * half * height_m * setup.voxel();
  const double slats_m2 = (2 * half + 1) * height_m * width_m;
  const double widest = std::max(width_m, setup.voxel()) / width_m;
  return {atMost("area in the gaps", 2.0, "%", 100.0 * in_gaps_m2 / gaps_m2),
          within("area on the slats", 85.0, 115.0 * widest, "%", 100.0 * on_slats_m2 / slats_m2)};
}

}  // namespace

void addSlatCases(std::vector<SceneCase>& cases) {
  const Stand stands[] = {{"upright, on grid planes", 0.0, 0.0, 0.0},
                          {"upright, between grid planes", 0.0, 0.0, 0.43},
                          {"turned by 20 degrees", 20.0, 0.0, 0.43},
                          {"turned by 45 degrees", 45.0, 0.0, 0.43},
                          {"tilted by 30 degrees", 0.0, 30.0, 0.43},
                          {"turned by 20, tilted by 30 degrees", 20.0, 30.0, 0.43}};
  for (const Stand& stand : stands) {
    cases.push_back({"slats", stand.name, true,
                     [stand](const SceneSetup& setup) { return measureStand(setup, stand); }});
  }
  for (const int width_mm : {10, 20}) {
    cases.push_back(
        {"slats", "two voxels apart, " + std::to_string(width_mm) + " mm wide", true,
         [width_mm](const SceneSetup& setup) { return measureChair(setup, 0.001 * width_mm); }});
  }
}

}  // namespace dtsdf
