#include "support/map_equality.h"
#include "support/block_snapshot.h"

#include <vector>

#include "support/same_bytes.h"

namespace dtsdf {

testing::AssertionResult sameMaps(ProbedMapper& a, ProbedMapper& b) {
  const std::vector<BlockSnapshot> x = snapshotOf(a), y = snapshotOf(b);
  if (x.size() != y.size()) {
    return testing::AssertionFailure() << x.size() << " blocks and " << y.size();
  }
  for (size_t i = 0; i < x.size(); ++i) {
    const BlockKey& key = x[i].key;
    const auto place = [&] {
      return testing::AssertionFailure()
             << "block (" << key.x << ", " << key.y << ", " << key.z << ") ";
    };
    if (key != y[i].key) return place() << "is in one map only";
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!sameBytes(x[i].voxels[d], y[i].voxels[d]))
        return place() << "differs in direction " << d;
      if (!sameBytes(x[i].colours[d], y[i].colours[d]))
        return place() << "differs in the colours of direction " << d;
    }
  }
  return testing::AssertionSuccess();
}

testing::AssertionResult sameMeshes(const Mesh& a, const Mesh& b) {
  if (!sameBytes(a.triangles, b.triangles)) {
    return testing::AssertionFailure()
           << "triangles differ: " << a.triangles.size() << " and " << b.triangles.size();
  }
  if (a.origin_m != b.origin_m) return testing::AssertionFailure() << "origins differ";
  if (!sameBytes(a.vertices_m, b.vertices_m)) {
    return testing::AssertionFailure()
           << "vertices differ: " << a.vertices_m.size() << " and " << b.vertices_m.size();
  }
  if (!sameBytes(a.normals, b.normals)) return testing::AssertionFailure() << "normals differ";
  if (!sameBytes(a.colours, b.colours)) return testing::AssertionFailure() << "colours differ";
  return testing::AssertionSuccess();
}

}  // namespace dtsdf
