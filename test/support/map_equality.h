/// Bitwise comparison of two maps or two meshes.
#pragma once

#include <gtest/gtest.h>

#include "dtsdf_mapping/mesh.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

testing::AssertionResult sameMaps(ProbedMapper& a, ProbedMapper& b);
testing::AssertionResult sameMeshes(const Mesh& a, const Mesh& b);

}  // namespace dtsdf
