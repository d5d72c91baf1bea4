// map_tool diff: compares two maps of the same place.
#include <algorithm>
#include <array>
#include <cstdio>
#include <numeric>
#include <optional>
#include <utility>

#include "dtsdf_mapping/io/mesh_file.h"
#include "io/atomic_file.h"
#include "kernels/core/vec.h"
#include "meshing/surface_distance.h"
#include "params/printable.h"
#include "program/progress_bar.h"
#include "program/run_program.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

/// What one map contains at a point on the other map's surface: the same surface
/// (kSame), free space (kChanged) or unknown space (kUnseen).
enum Kind : uint8_t { kSame, kChanged, kUnseen };

/// A map, its mesh, and a tree for finding the surface near a point.
class ComparedMap {
 public:
  explicit ComparedMap(const MapToolOptions& options)
      : info_(readMapInfo(options.map_path)),
        loaded_(loadMapOf(options, "space/enabled=true")),
        mesh_(meshOf(*loaded_.second, voxelSize_m())),
        tree_(mesh_.vertices_m, mesh_.triangles) {
    if (loaded_.second->stats().free_bytes == 0) {
      throw std::runtime_error("'" + options.map_path +
                               "' contains no free cells, so changes cannot be found; "
                               "build it with --set space/enabled=true");
    }
  }

  const MapInfo& info() const { return info_; }
  const Mesh& mesh() const { return mesh_; }
  float voxelSize_m() const { return loaded_.first.params.mapper.map.voxel_size_m; }

  /// What the map contains at a point, given in its frame. @param hint Speeds up the search if the
  /// same variable is passed to successive calls.
  Kind at(const Eigen::Vector3d& p_W, double near_m, SurfaceTree::Hint& hint) const {
    const Vec3f p{static_cast<float>(p_W.x() - mesh_.origin_m[0]),
                  static_cast<float>(p_W.y() - mesh_.origin_m[1]),
                  static_cast<float>(p_W.z() - mesh_.origin_m[2])};
    const double reach_m = near_m + kReach_m;
    const double distance_m = tree_.distance(p, reach_m, {0.0f, 0.0f, 1.0f}, 2.0f, hint);
    if (distance_m <= near_m) return kSame;
    const Space& space = *loaded_.second->space();
    if (space.stateOf(space.cellAt(p_W)) == CellState::kFree) return kChanged;
    return distance_m < reach_m && isSeenThrough(p, p_W, distance_m, hint) ? kChanged : kUnseen;
  }

 private:
  /// A cell becomes free only if rays pass it with a margin that grows with noise. So cells up to
  /// half a metre in front of a surface, such as a floor 5 m from the camera, stay unknown.
  static constexpr double kReach_m = 0.5;

  /// Whether a point counts as free although its cell is not. It must lie in front of the nearest
  /// triangle and, if farther from it than the truncation distance, between a free cell and another
  /// known cell along some axis.
  bool isSeenThrough(const Vec3f& p, const Eigen::Vector3d& p_W, double distance_m,
                     SurfaceTree::Hint nearest) const {
    const auto& corners = tree_.cornersOf(nearest);
    const Vec3f& a = mesh_.vertices_m[corners[0]];
    const Vec3f n = cross(mesh_.vertices_m[corners[1]] - a, mesh_.vertices_m[corners[2]] - a);
    const double cosine = static_cast<double>(dot(n, p - a) / norm(n)) / distance_m;
    constexpr double kInPlane = 0.5;  // a point past the edge of a surface is not in front
    const MapParams& map = loaded_.first.params.mapper.map;
    const auto truncation_m = static_cast<double>(map.truncation_voxels * map.voxel_size_m);
    if (!(cosine > 0.0) || distance_m < truncation_m) return cosine > kInPlane;
    for (int axis = 0; axis < 3; ++axis) {
      const CellState below = firstKnown(p_W, -Eigen::Vector3d::Unit(axis)),
                      above = firstKnown(p_W, Eigen::Vector3d::Unit(axis));
      if ((below == CellState::kFree && above != CellState::kUnknown) ||
          (above == CellState::kFree && below != CellState::kUnknown)) {
        return true;
      }
    }
    return false;
  }

  /// State of the first known cell along a ray; unknown if none is within kReach_m.
  CellState firstKnown(const Eigen::Vector3d& p_W, const Eigen::Vector3d& direction) const {
    const Space& space = *loaded_.second->space();
    CellState state = CellState::kUnknown;
    const double cell_m = space.cellSize_m();
    for (int step = 0; step * cell_m < kReach_m && state == CellState::kUnknown; ++step) {
      state = space.stateOf(space.cellAt(p_W + step * cell_m * direction));
    }
    return state;
  }

  const MapInfo info_;
  const std::pair<RunSettings, std::unique_ptr<Mapper>> loaded_;
  const Mesh mesh_;
  const SurfaceTree tree_;
};

double areaOf(const Mesh& mesh, size_t triangle) {
  const auto& corners = mesh.triangles[triangle];
  const Vec3f& a = mesh.vertices_m[corners[0]];
  return 0.5 * static_cast<double>(
                   norm(cross(mesh.vertices_m[corners[1]] - a, mesh.vertices_m[corners[2]] - a)));
}

/// Union-find: the root of the connected piece that a vertex belongs to.
uint32_t rootOf(std::vector<uint32_t>& parents, uint32_t vertex) {
  while (parents[vertex] != vertex) vertex = parents[vertex] = parents[parents[vertex]];
  return vertex;
}

/// Marks connected pieces of changed surface as unchanged if they are smaller than `min_m2`.
void dropSmallPieces(const Mesh& mesh, double min_m2, std::vector<Kind>& kinds) {
  std::vector<uint32_t> parents(mesh.vertices_m.size());
  std::iota(parents.begin(), parents.end(), 0u);
  for (size_t i = 0; i < kinds.size(); ++i) {
    const auto& corners = mesh.triangles[i];
    if (kinds[i] != kChanged) continue;
    for (const uint32_t corner : corners) {
      parents[rootOf(parents, corner)] = rootOf(parents, corners[0]);
    }
  }
  std::vector<double> areas_m2(parents.size());
  const auto pieceArea = [&](size_t i) -> double& {
    return areas_m2[rootOf(parents, mesh.triangles[i][0])];
  };
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] == kChanged) pieceArea(i) += areaOf(mesh, i);
  }
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] == kChanged && pieceArea(i) < min_m2) kinds[i] = kSame;
  }
}

/// What another map contains at each triangle of a mesh; T_O_W transforms from the mesh's frame to
/// that of the other map.
/// @param near_m A surface of the other map within this distance counts as the same surface.
/// @param min_m2 Smaller connected pieces of changed surface count as unchanged.
std::vector<Kind> compare(const Mesh& mesh, const ComparedMap& other,
                          const Eigen::Isometry3d& T_O_W, double near_m, double min_m2) {
  std::vector<Kind> kinds;
  kinds.reserve(mesh.triangles.size());
  ProgressBar progress("triangles", mesh.triangles.size());
  SurfaceTree::Hint hint = SurfaceTree::kNoHint;
  for (const auto& triangle : mesh.triangles) {
    Eigen::Vector3d middle_W = Eigen::Vector3d::Zero();
    for (const uint32_t corner : triangle) {
      middle_W += Eigen::Vector3d(positionInMap(mesh, corner).data()) / 3.0;
    }
    kinds.push_back(other.at(T_O_W * middle_W, near_m, hint));
    progress.show(kinds.size());
  }
  dropSmallPieces(mesh, min_m2, kinds);
  return kinds;
}

/// Adds the triangles of one kind to a drawing in the frame of map A, unless `colour` is missing.
/// @return their area, in square metres.
double addTriangles(const Mesh& mesh, const Eigen::Isometry3d& T_A_W,
                    const std::vector<Kind>& kinds, Kind kind,
                    const std::optional<VertexColour>& colour, Mesh& drawing) {
  double area_m2 = 0.0;
  constexpr uint32_t kNone = 0xffffffffu;
  std::vector<uint32_t> numbers(colour ? mesh.vertices_m.size() : 0, kNone);
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] != kind) continue;
    area_m2 += areaOf(mesh, i);
    if (!colour) continue;
    std::array<uint32_t, 3> corners = mesh.triangles[i];
    for (uint32_t& corner : corners) {
      uint32_t& number = numbers[corner];
      if (number == kNone) {
        number = static_cast<uint32_t>(drawing.vertices_m.size());
        const Eigen::Vector3d p_W(positionInMap(mesh, corner).data());
        const Eigen::Vector3f p =
            (T_A_W * p_W - Eigen::Vector3d(drawing.origin_m.data())).cast<float>();
        const Vec3f& n_W = mesh.normals[corner];
        const Eigen::Vector3f n =
            T_A_W.linear().cast<float>() * Eigen::Vector3f(n_W.x, n_W.y, n_W.z);
        drawing.vertices_m.push_back({p.x(), p.y(), p.z()});
        drawing.normals.push_back({n.x(), n.y(), n.z()});
        drawing.colours.push_back(*colour);
      }
      corner = number;
    }
    drawing.triangles.push_back(corners);
  }
  return area_m2;
}

/// Returns T_A_B. The poses of both maps are in one frame, but each map may be levelled separately.
/// @throws std::runtime_error if the frames differ.
Eigen::Isometry3d frameOfBInA(const MapInfo& a, const MapInfo& b) {
  if (!a.map_frame.empty() && !b.map_frame.empty() && a.map_frame != b.map_frame) {
    throw std::runtime_error("the maps are in different frames, '" + printable(a.map_frame) +
                             "' and '" + printable(b.map_frame) +
                             "'; only maps in one frame can be compared");
  }
  const Eigen::Isometry3d none = Eigen::Isometry3d::Identity();
  return a.T_W_M.value_or(none) * b.T_W_M.value_or(none).inverse();
}

}  // namespace

void compareMaps(const std::vector<std::string>& arguments) {
  MapToolOptions a, b;
  std::optional<double> tolerance_m;
  double min_cm2 = 100.0;
  bool changes_only = false;
  CommandLine line("map_tool diff", "A B [--mesh OUT] [options]",
                   "Compares two maps of the same place, built in one frame with space/enabled. "
                   "Green: added (a surface of B in free space of A). Red: gone (a surface of A in "
                   "free space of B). Blue: a surface of one map where the other map is unknown. "
                   "Grey: unchanged. Prints the area of each.");
  line.addText({"A", "", "the earlier map"}, a.map_path);
  line.addText({"B", "", "the later map"}, b.map_path);
  line.addText({"--mesh", "OUT", std::string("a mesh to write: ") + kMeshExtensions}, a.out_path);
  line.addNumber(
      {"--tolerance", "METRES",
       "surfaces within this distance count as the same (default: twice the larger voxel size)"},
      tolerance_m, {0.0, 10.0});
  line.addNumber({"--least-area", "CM2", "smaller changes count as unchanged"}, min_cm2,
                 {0.0, 1e6});
  line.addFlag("--changes-only", "leave out unchanged surfaces", changes_only);
  addSettings(line, "mesh/..., backend, threads", a);
  line.parse(arguments);
  if (!a.out_path.empty()) {
    checkMeshPath(a.out_path);
    prepareOutputFile(a.out_path);
  }
  b.settings = a.settings;
  const ComparedMap before(a), after(b);
  const Eigen::Isometry3d T_A_B = frameOfBInA(before.info(), after.info());
  const double voxel_m = static_cast<double>(std::max(before.voxelSize_m(), after.voxelSize_m()));
  const double near_m = tolerance_m.value_or(2.0 * voxel_m), min_m2 = 1e-4 * min_cm2;
  const std::vector<Kind> in_after = compare(before.mesh(), after, T_A_B.inverse(), near_m, min_m2);
  const std::vector<Kind> in_before = compare(after.mesh(), before, T_A_B, near_m, min_m2);
  constexpr VertexColour kGreen{40, 170, 60, 255}, kRed{215, 45, 40, 255}, kBlue{60, 110, 220, 255},
      kGrey{190, 190, 190, 255};
  Mesh drawing;
  drawing.origin_m = before.mesh().origin_m;
  const auto add = [&](const char* what, const ComparedMap& map, Kind kind,
                       std::optional<VertexColour> colour) {
    const bool is_before = &map == &before;
    const double area_m2 =
        addTriangles(map.mesh(), is_before ? Eigen::Isometry3d::Identity() : T_A_B,
                     is_before ? in_after : in_before, kind, colour, drawing);
    std::printf("%-16s %10.4f m2\n", what, area_m2);
    return area_m2;
  };
  const double added_m2 = add("added", after, kChanged, kGreen);
  const double gone_m2 = add("gone", before, kChanged, kRed);
  add("unknown in A", after, kUnseen, kBlue);
  add("unknown in B", before, kUnseen, kBlue);
  const double same_m2 =
      add("unchanged", before, kSame, changes_only ? std::nullopt : std::optional(kGrey));
  if (same_m2 <= added_m2 + gone_m2) {
    std::fprintf(
        stderr,
        "map_tool diff: warning: little or nothing is unchanged; are both maps of the same "
        "place and in the same frame?\n");
  }
  if (a.out_path.empty()) return;
  if (drawing.triangles.empty()) {
    std::printf("nothing to draw: no mesh was written\n");
    return;
  }
  saveMesh(drawing, MeshColour::kImage, a.out_path);
  std::printf("%zu triangles: %s\n", drawing.triangles.size(), a.out_path.c_str());
}

}  // namespace dtsdf
