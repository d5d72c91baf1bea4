#include "ros/common/chunk_message.h"

#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>
#include <string>

namespace dtsdf {
namespace {

using dtsdf_mapping::MeshBlock;

MeshBlock validBlock() {
  MeshBlock block;
  block.origin = {-5 * (int64_t{1} << 32), 7, 0};
  block.positions = {0, 0, 0, 512, 0, 0, 0, 65535, 0};
  block.normals = {0, 0, 1, -1, 32767, 0};
  block.colours = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  block.triangles = {0, 1, 2};
  return block;
}

TEST(ChunkMessage, SurvivesARoundTrip) {
  const MeshBlock sent = validBlock();
  EXPECT_TRUE(toMessage(toChunk(sent)) == sent);
  const MeshBlock removal = [] {
    MeshBlock block;
    block.origin = {1, 2, 3};
    return block;
  }();
  EXPECT_TRUE(toMessage(toChunk(removal)) == removal);
}

TEST(ChunkMessage, IsRefusedIfInconsistent) {
  const auto expectRefused = [](const std::string& word, std::function<void(MeshBlock&)> spoil) {
    MeshBlock block = validBlock();
    spoil(block);
    try {
      toChunk(block);
      ADD_FAILURE() << "accepted: " << word;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  expectRefused("number of vertices", [](MeshBlock& block) { block.positions.push_back(1); });
  expectRefused("number of vertices", [](MeshBlock& block) { block.normals.pop_back(); });
  expectRefused("number of vertices", [](MeshBlock& block) { block.colours.pop_back(); });
  expectRefused("not a multiple of 3", [](MeshBlock& block) { block.triangles.push_back(0); });
  expectRefused("vertex 3, but there are only 3", [](MeshBlock& block) { block.triangles[1] = 3; });
  expectRefused("both 16-bit and 32-bit", [](MeshBlock& block) { block.triangles32 = {0, 1, 2}; });
  expectRefused("vertex 4000000000, but there are only 3", [](MeshBlock& block) {
    block.triangles.clear();
    block.triangles32 = {0, 1, 4000000000u};
  });
  expectRefused("out of range", [](MeshBlock& block) { block.origin[2] = int64_t{1} << 62; });
}

}  // namespace
}  // namespace dtsdf
