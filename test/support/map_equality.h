/// Whether two maps, or two meshes, are the same to the last bit.
#pragma once

#include <gtest/gtest.h>

#include "dtsdf_mapping/mapper/mapper.h"
#include "dtsdf_mapping/meshing/mesh.h"

namespace dtsdf {

testing::AssertionResult sameMaps(Mapper& a, Mapper& b);
testing::AssertionResult sameMeshes(const Mesh& a, const Mesh& b);

}  // namespace dtsdf
