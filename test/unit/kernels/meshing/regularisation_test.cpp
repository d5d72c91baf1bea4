#include "kernels/meshing/regularisation.h"

#include <gtest/gtest.h>

#include <vector>

#include "unit/kernels/meshing/unit_planes.h"

namespace dtsdf {
namespace regularisation_test {

/// A cube of mesh units, each with eight voxels as its corners. Other units contain no surface.
class Units {
 public:
  explicit Units(int side) : side_(side), labels_(static_cast<size_t>(side * side * side)) {}

  UnitLabels& at(const Vec3i& unit) {
    return labels_[static_cast<size_t>(unit.x + side_ * (unit.y + side_ * unit.z))];
  }
  UnitLabels operator()(const Vec3i& unit) const {
    const auto inside = [&](int x) { return x >= 0 && x < side_; };
    if (!inside(unit.x) || !inside(unit.y) || !inside(unit.z)) return {0, 0};
    return const_cast<Units*>(this)->at(unit);
  }
  UnitIndices regular(const Vec3i& unit) const {
    unsigned behind = 0;
    for (int c = 0; c < kCubeCorners; ++c) {
      const int balance = cornerBalance(*this, unit + cornerOffset(c));
      behind |= isMajorityBehind(balance) ? 1u << c : 0u;
    }
    return regularise((*this)(unit), behind);
  }

 private:
  int side_;
  std::vector<UnitLabels> labels_;
};

UnitLabels single(int index) {
  return labelsOfSheets(static_cast<unsigned>(index), static_cast<unsigned>(index));
}

/// Eight units surround a corner. `behind` units label the corner as behind the surface, and
/// `in_front` units label it as in front. All of them adopt the label of the majority, or "in
/// front" in a tie. The remaining units have no vote and stay unchanged.
TEST(Regularisation, TheMajorityDecidesACorner) {
  for (int behind = 0; behind <= 8; ++behind) {
    for (int in_front = 0; behind + in_front <= 8; ++in_front) {
      Units units(2);
      const Vec3i corner{1, 1, 1};
      for (int c = 0; c < behind + in_front; ++c) {
        units.at(corner - cornerOffset(c)) = single(c < behind ? 1 << c : 0);
      }
      for (int c = 0; c < 8; ++c) {
        const int index = units.regular(corner - cornerOffset(c)).sheet[0];
        const bool has_index = c < behind + in_front;
        EXPECT_EQ(index >> c & 1, has_index && behind > in_front ? 1 : 0)
            << behind << " behind, " << in_front << " in front, unit " << c;
      }
    }
  }
}

}  // namespace regularisation_test
}  // namespace dtsdf
