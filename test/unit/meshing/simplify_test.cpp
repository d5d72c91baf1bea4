#include "dtsdf_mapping/simplify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <stdexcept>

#include "kernels/core/vec.h"
#include "meshing/surface_distance.h"
#include "support/mesh_topology.h"

namespace dtsdf {
namespace {

/// Adds a height field over a square with sides of `side_m`, sampled every `step_m`, facing up or
/// down.
template <class Height>
void addSheet(Mesh& mesh, float side_m, float step_m, bool up, const Height& height) {
  const auto first = static_cast<uint32_t>(mesh.vertices_m.size());
  const auto cells = static_cast<uint32_t>(std::lround(side_m / step_m));
  for (uint32_t y = 0; y <= cells; ++y) {
    for (uint32_t x = 0; x <= cells; ++x) {
      const float at_x = step_m * static_cast<float>(x), at_y = step_m * static_cast<float>(y);
      mesh.vertices_m.push_back({at_x, at_y, height(at_x, at_y)});
      mesh.normals.push_back({0.0f, 0.0f, up ? 1.0f : -1.0f});
    }
  }
  for (uint32_t y = 0; y < cells; ++y) {
    for (uint32_t x = 0; x < cells; ++x) {
      const uint32_t a = first + x + y * (cells + 1), b = a + 1, c = a + cells + 1, d = c + 1;
      mesh.triangles.push_back({a, up ? b : d, up ? d : b});
      mesh.triangles.push_back({a, up ? d : c, up ? c : d});
    }
  }
}

class Simplify : public testing::Test {};

/// The largest distance from a vertex of `from` to the mesh `to`.
double largestDistance(const Mesh& from, const Mesh& to) {
  const SurfaceTree tree(to.vertices_m, to.triangles);
  double largest = 0.0;
  for (const Vec3f& p : from.vertices_m) largest = std::max(largest, tree.distance(p, 10.0));
  return largest;
}

std::set<std::array<float, 3>> placesOf(const Mesh& mesh) {
  std::set<std::array<float, 3>> places;
  for (const Vec3f& p : mesh.vertices_m) places.insert({p.x, p.y, p.z});
  return places;
}

/// A plane needs vertices only at its border. The remaining error is due to rounding to floats.
TEST_F(Simplify, ReducesAPlaneButKeepsItsBorder) {
  Mesh mesh;
  addSheet(mesh, 1.0f, 0.02f, true, [](float, float) { return 0.1f; });
  const SimplifiedMesh simple = simplifyMesh(mesh, 0.002);
  EXPECT_LT(simple.mesh.triangles.size(), mesh.triangles.size() / 10);
  EXPECT_LT(simple.error_m, 1e-6);
  const auto places = placesOf(simple.mesh);
  for (const Vec3f& p : mesh.vertices_m) {
    const bool is_border = p.x == 0.0f || p.y == 0.0f || p.x > 0.99f || p.y > 0.99f;
    EXPECT_TRUE(!is_border || places.count({p.x, p.y, p.z}) == 1);
  }
}

/// The reported error equals the measured error and does not exceed the limit.
TEST_F(Simplify, RespectsTheLimitAndReportsTheError) {
  Mesh mesh;
  addSheet(mesh, 2.0f, 0.02f, true,
           [](float x, float y) { return 0.1f * std::sin(4.0f * x) * std::cos(3.0f * y); });
  size_t last = mesh.triangles.size();
  for (const double error_m : {0.0005, 0.002, 0.008}) {
    const SimplifiedMesh simple = simplifyMesh(mesh, error_m);
    EXPECT_LE(simple.error_m, error_m);
    EXPECT_GT(simple.error_m, 0.02 * error_m);
    EXPECT_NEAR(simple.error_m, largestDistance(mesh, simple.mesh), 1e-6);
    EXPECT_LT(simple.mesh.triangles.size(), last / 1.5) << error_m;
    last = simple.mesh.triangles.size();
    const MeshTopology topology = measureTopology(simple.mesh);
    EXPECT_EQ(topology.boundary_edges, 400u) << "the border should not change: " << topology;
    EXPECT_EQ(topology.nonmanifold_edges + topology.inconsistent_edges, 0u) << topology;
    EXPECT_EQ(topology.unused_vertices, 0u) << topology;
  }
}

/// The noisy sides of a 5 mm plate must not touch, although the error limit is 20 mm.
TEST_F(Simplify, KeepsTheSidesOfAThinPlateApart) {
  constexpr float kThickness_m = 0.005f;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> noise(-0.0006f, 0.0006f);
  Mesh mesh;
  addSheet(mesh, 1.0f, 0.01f, true, [&](float x, float) {
    return kThickness_m + 0.05f * std::sin(5.0f * x) + noise(random);
  });
  addSheet(mesh, 1.0f, 0.01f, false,
           [&](float x, float) { return 0.05f * std::sin(5.0f * x) + noise(random); });
  const SimplifiedMesh simple = simplifyMesh(mesh, 0.02);
  EXPECT_LT(simple.mesh.triangles.size(), mesh.triangles.size() / 2);
  EXPECT_LE(simple.error_m, 0.02);
  // Checks that the upper side lies above the lower side at each sampled point.
  Mesh upper = simple.mesh, lower = simple.mesh;
  const auto looksUp = [&](const std::array<uint32_t, 3>& t) {
    const auto& v = simple.mesh.vertices_m;
    return cross(v[t[1]] - v[t[0]], v[t[2]] - v[t[0]]).z > 0.0f;
  };
  upper.triangles.clear();
  lower.triangles.clear();
  for (const auto& t : simple.mesh.triangles) (looksUp(t) ? upper : lower).triangles.push_back(t);
  const auto heightAt = [](const Mesh& side, float x, float y) {
    for (const auto& t : side.triangles) {
      const std::vector<Vec3f>& v = side.vertices_m;
      const Vec3f &a = v[t[0]], &b = v[t[1]], &c = v[t[2]];
      const Vec3f n = cross(b - a, c - a);
      const auto edge = [&](const Vec3f& p, const Vec3f& q) {
        return ((q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)) * (n.z > 0.0f ? 1.0f : -1.0f);
      };
      if (edge(a, b) < 0.0f || edge(b, c) < 0.0f || edge(c, a) < 0.0f) continue;
      return a.z - (n.x * (x - a.x) + n.y * (y - a.y)) / n.z;
    }
    return std::nanf("");
  };
  for (float y = 0.013f; y < 1.0f; y += 0.037f) {
    for (float x = 0.007f; x < 1.0f; x += 0.029f) {
      EXPECT_GT(heightAt(upper, x, y) - heightAt(lower, x, y), 0.0005f) << x << " " << y;
    }
  }
}

TEST_F(Simplify, IsDeterministic) {
  Mesh mesh;
  addSheet(mesh, 3.0f, 0.02f, true, [](float x, float y) { return 0.1f * x * y; });
  mesh.colours.assign(mesh.vertices_m.size(), VertexColour{1, 2, 3, 255});
  const SimplifiedMesh a = simplifyMesh(mesh, 0.003), b = simplifyMesh(mesh, 0.003);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
  EXPECT_EQ(placesOf(a.mesh), placesOf(b.mesh));
  EXPECT_EQ(a.mesh.colours.size(), a.mesh.vertices_m.size());
  EXPECT_EQ(a.mesh.normals.size(), a.mesh.vertices_m.size());
}

/// A larger error limit never leaves more triangles, even where single vertices cannot be removed.
TEST_F(Simplify, ALargerLimitNeverLeavesMoreTriangles) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> noise(-0.002f, 0.002f);
  Mesh mesh;
  addSheet(mesh, 2.0f, 0.02f, true, [&](float x, float y) {
    const float spike = std::abs(x - 1.0f) < 0.005f && std::abs(y - 1.0f) < 0.005f ? 0.5f : 0.0f;
    return 0.1f * std::sin(4.0f * x) * std::cos(3.0f * y) + noise(random) + spike;
  });
  size_t last = mesh.triangles.size();
  for (double error_m = 1e-4; error_m < 2.8; error_m *= 1.37) {
    const SimplifiedMesh simple = simplifyMesh(mesh, error_m);
    EXPECT_LE(simple.mesh.triangles.size(), last) << error_m;
    EXPECT_LE(simple.error_m, error_m);
    last = simple.mesh.triangles.size();
  }
  EXPECT_LT(last, 600u) << "few triangles should remain besides those at the border";
}

TEST_F(Simplify, ReportsProgressAndCanBeCancelled) {
  Mesh mesh;
  addSheet(mesh, 3.0f, 0.01f, true, [](float x, float y) { return 0.1f * std::sin(9.0f * x * y); });
  double last = -1.0;
  simplifyMesh(mesh, 0.01, [&](double share) {
    EXPECT_GE(share, last);
    last = share;
  });
  EXPECT_GT(last, 0.8);
  EXPECT_LE(last, 1.0);
  for (const double at : {0.0, 0.1, 0.6}) {
    const auto cancel = [&](double share) {
      if (share >= at) throw std::runtime_error("cancelled");
    };
    EXPECT_THROW(simplifyMesh(mesh, 0.01, cancel), std::runtime_error);
  }
}

TEST_F(Simplify, AZeroLimitChangesNothing) {
  Mesh mesh;
  addSheet(mesh, 1.0f, 0.1f, true, [](float, float) { return 0.0f; });
  EXPECT_EQ(simplifyMesh(mesh, 0.0).mesh.triangles, mesh.triangles);
}

TEST(SimplifyArguments, InvalidLimitsAreRefused) {
  Mesh mesh;
  addSheet(mesh, 3.0f, 0.5f, true, [](float, float) { return 0.0f; });
  for (const double error_m :
       {-1.0, std::nan(""), std::numeric_limits<double>::infinity(), 1e308, 4.3}) {
    EXPECT_THROW(simplifyMesh(mesh, error_m), std::invalid_argument) << error_m;
  }
  EXPECT_NO_THROW(simplifyMesh(mesh, 4.2));
}

}  // namespace
}  // namespace dtsdf
