// Tests which surfaces (sheets) are found in a mesh unit, a cube with eight voxels as corners.
#include "kernels/meshing/sheets.h"

#include <gtest/gtest.h>

#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace sheets_test {

/// The marching-cubes cases of a unit's sheets, before regularisation (see regularisation.h).
UnitIndices indexUnit(const UnitSamples& samples, bool directional) {
  return indicesOf(labelUnit(kMeshTables, MeshRules(), samples, directional));
}

TEST(Sheets, APlaneGivesOneSheet) {
  std::mt19937 random(18);
  for (int trial = 0; trial < 5000; ++trial) {
    const UnitPlane plane = randomPlane(random);
    UnitSamples samples = {};
    addPlane(samples, plane);
    const int labels = labelsOf(plane);
    const UnitIndices indices = indexUnit(samples, true);
    EXPECT_EQ(indices.sheet[0], labels) << "trial " << trial;
    EXPECT_EQ(indices.sheet[1], 0) << "trial " << trial;
  }
}

/// A wall thinner than the unit. Each side is measured in the direction that it faces.
TEST(Sheets, AThinWallHasTwoSheets) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d n = Eigen::Vector3d::Unit(axis);
    for (const double thickness : {0.05, 0.3, 0.8}) {
      const UnitPlane front{n, 0.5 + 0.5 * thickness}, back{-n, -(0.5 - 0.5 * thickness)};
      UnitSamples samples = {};
      addPlane(samples, front);
      addPlane(samples, back);
      const UnitIndices indices = indexUnit(samples, true);
      const std::set<int> sheets{indices.sheet[0], indices.sheet[1]};
      EXPECT_EQ(sheets, (std::set<int>{labelsOf(front), labelsOf(back)}))
          << "axis " << axis << ", thickness " << thickness;
    }
  }
}

}  // namespace sheets_test
}  // namespace dtsdf
