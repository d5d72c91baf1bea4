#include "kernels/meshing/vertex_normal.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "support/random_vectors.h"

namespace dtsdf {
namespace vertex_normal_test {

/// The distance fields of all directions. Checks that no samples are read outside the range that
/// incremental meshing accounts for.
struct Fields {
  std::function<float(const Vec3f&, int direction)> distance;
  std::function<float(const Vec3i&, int direction)> weight;

  Sample sample(const Vec3i& corner, int direction) const {
    int beyond = 0;  // number of axes along which the corner is outside the grid
    for (int axis = 0; axis < 3; ++axis) {
      const int at = component(corner, axis);
      EXPECT_TRUE(at >= -1 && at <= kCornerGridSide);
      beyond += at < 0 || at >= kCornerGridSide;
    }
    EXPECT_LE(beyond, 1);
    return {distance(toFloat(corner), direction), weight(corner, direction)};
  }
};

float everywhere(const Vec3i&, int) { return 1.0f; }

void expectNear(const Vec3f& a, const Vec3f& b, float tolerance) {
  EXPECT_LT(norm(a - b), tolerance)
      << a.x << " " << a.y << " " << a.z << ", not " << b.x << " " << b.y << " " << b.z;
}

TEST(VertexNormal, OfAPlaneIsItsNormalOnEveryEdge) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> share(0.0f, 1.0f);
  int found = 0;
  for (int edge = 0; edge < kGridEdges; ++edge) {
    const Vec3f normal = randomUnit(random);
    const Vec3f p = vertexPosition(edge, share(random));
    const Vec3i corner = cornerAt(edgeCorner(edge));
    if (component(corner, edgeAxis(edge)) == kBlockSide) continue;  // ends outside the grid
    const Fields fields{[&](const Vec3f& at, int) { return dot(normal, at - p); }, everywhere};
    const bool faces = (component(normal, edgeAxis(edge)) > 0.0f) == (edgeFacing(edge) == 0);
    const Vec3f expected = faces ? normal : Vec3f{0.0f, 0.0f, 0.0f};
    expectNear(vertexNormal(fields, edge, p, false), expected, 1e-5f);
    expectNear(vertexNormal(fields, edge, p, true), expected, 1e-5f);
    found += faces;
  }
  EXPECT_GT(found, 1500);
}

/// The normal is exact for a quadratic field. Here, z + y / 4 + x^2 / 16 + y^2 / 8 + z^2 / 8 has
/// the gradient (x / 8, (y + 1) / 4, 1 + z / 4) at (2, -1, t - 1 / 2).
TEST(VertexNormal, OfAQuadraticFieldIsExact) {
  const Fields fields{[](const Vec3f& p, int) {
                        const float x = p.x - 4.0f, y = p.y - 4.0f, z = p.z - 4.5f;
                        return z + x * x / 16.0f + y * y / 8.0f + z * z / 8.0f + y / 4.0f;
                      },
                      everywhere};
  for (const float t : {0.25f, 0.5f, 0.875f}) {
    const Vec3f gradient{2.0f / 8.0f, 0.25f - 1.0f / 4.0f, 1.0f + (t - 0.5f) / 4.0f};
    const int edge = edgeNumber(cornerIndex(6, 3, 4), 2, 0);
    // Lowers the field so that the surface crosses this edge.
    const Fields crossed{[&](const Vec3f& p, int d) { return fields.distance(p, d) - 0.125f; },
                         everywhere};
    expectNear(vertexNormal(crossed, edge, vertexPosition(edge, t), false),
               (1.0f / norm(gradient)) * gradient, 1e-5f);
  }
}

}  // namespace vertex_normal_test
}  // namespace dtsdf
