#include <gtest/gtest.h>

#include <fstream>

#include "evaluation/triangle_mesh.h"
#include "support/temporary_folder.h"
#include "unit/evaluation/test_meshes.h"

namespace dtsdf {
namespace {

class Ply : public testing::Test {
 protected:
  std::string write(const std::string& bytes) {
    const std::string path = folder_ / "mesh.ply";
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }

  std::string errorFor(const std::string& bytes) {
    const std::string path = write(bytes);
    const std::string error = errorOf([&] { readPly(path); });
    EXPECT_NE(error.find(path), std::string::npos) << "the error should name the file";
    return error;
  }

  TemporaryFolder folder_;
};

TEST_F(Ply, ReadsAsciiPolygonsIgnoringOtherProperties) {
  const TriangleMesh mesh = readPly(write(
      "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement vertex 4\r\nproperty float nx\r\n"
      "property double x\r\nproperty float y\r\nproperty float z\r\nproperty uchar red\r\n"
      "property uchar green\r\nproperty uchar blue\r\nelement face 1\r\n"
      "property list uchar int vertex_index\r\nend_header\r\n"
      "9 0 0 0 1 2 3\r\n9 1 0 0 4 5 6\r\n9 1 1 0 7 8 9\r\n9 0 1 0.5 10 11 12\r\n4 0 1 2 3\r\n"));
  ASSERT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.vertices[3], Eigen::Vector3f(0, 1, 0.5f));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.triangles[1], (std::array<uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(mesh.colours[2], (std::array<uint8_t, 3>{7, 8, 9}));
}

TEST_F(Ply, IsReadBackUnchanged) {
  TriangleMesh mesh = makeSphere(0.3f, 10);
  mesh.colours.assign(mesh.vertices.size(), {1, 2, 3});
  const std::string path = folder_ / "sphere.ply";
  writePly(path, mesh);
  const TriangleMesh again = readPly(path);
  EXPECT_EQ(again.vertices, mesh.vertices);
  EXPECT_EQ(again.triangles, mesh.triangles);
  EXPECT_EQ(again.colours, mesh.colours);
}

TEST_F(Ply, RefusesInvalidMeshes) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string ply = "ply\nformat ascii 1.0\n", vertex = ply + "element vertex 1\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string mesh = vertex + xyz + face + "end_header\n";
  for (const std::string& bytes :
       {std::string("solid\n"), ply, mesh + "0 0", mesh + "0 0 0\n3 0 0 1\n",
        ply + face + "element vertex 1\n" + xyz + "end_header\n1 0\n0 0 0\n",
        vertex + "property float x\nend_header\n0", mesh + "nan 0 0\n3 0 0 0\n",
        mesh + "0 0 0\nnan 0 0 0\n", mesh + "0 0 0\n3 0 nan 0\n",
        vertex + xyz + "property float red\nproperty float green\nproperty float blue\n" +
            "end_header\n0 0 0 nan 256 -1\n",
        std::string("ply\nformat binary_big_endian 1.0\n")}) {
    EXPECT_NE(errorFor(bytes), "") << bytes;
  }
  EXPECT_THROW(readPly(folder_ / "absent.ply"), std::runtime_error);
  EXPECT_THROW(readPly("/dev/zero"), std::runtime_error);
}

TEST(TriangleMesh, IsCentredAndScaled) {
  TriangleMesh mesh = moved(makeCube(2.0f), {5, 6, 7});
  mesh.vertices[0].x() -= 4.0f;  // longest side: 8, along x
  centreAndScale(mesh, 1.0f);
  Eigen::Vector3f low = mesh.vertices[0], high = low;
  for (const auto& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  EXPECT_TRUE(low.isApprox(Eigen::Vector3f(-0.5f, -0.25f, -0.25f), 1e-6f));
  EXPECT_TRUE(high.isApprox(Eigen::Vector3f(0.5f, 0.25f, 0.25f), 1e-6f));
}

TEST(TriangleMesh, SamplesAreUniformByArea) {
  // Two rectangles with areas of 9 and 1.
  const TriangleMesh mesh = joined(makeRectangle(0, 0, 3, 3, 0), makeRectangle(0, 0, 1, 1, 1));
  const SurfaceSamples samples = sampleSurface(mesh, 100000, 3);
  ASSERT_EQ(samples.points.size(), 100000u);
  size_t small = 0, left = 0;
  for (const Eigen::Vector3f& p : samples.points) {
    if (p.z() > 0.5f) ++small;
    if (p.z() < 0.5f && p.x() < 1.0f) ++left;
  }
  EXPECT_NEAR(small, 10000, 10);
  EXPECT_NEAR(left, 30000, 500);
  EXPECT_EQ(sampleSurface(mesh, 100, 3).points, sampleSurface(mesh, 100, 3).points);
  EXPECT_NE(sampleSurface(mesh, 100, 3).points, sampleSurface(mesh, 100, 4).points);
  EXPECT_TRUE(sampleSurface(TriangleMesh{}, 100, 3).points.empty());
}

}  // namespace
}  // namespace dtsdf
