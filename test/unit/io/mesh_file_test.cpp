#include "dtsdf_mapping/io/mesh_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "io/glb.h"
#include "kernels/core/vec.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

/// Two triangles with a common edge, in the planes z = 0 and x = 0.
Mesh makeMesh() {
  Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, -0.1f}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {1, 0, 0}};
  mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}};
  return mesh;
}

/// Reads consecutive little-endian numbers.
class LittleEndianReader {
 public:
  explicit LittleEndianReader(std::string bytes) : bytes_(std::move(bytes)) {}

  std::string text(size_t count) {
    next_ += count;
    return bytes_.substr(next_ - count, count);
  }
  uint32_t number(size_t count) {
    uint32_t value = 0;
    const std::string part = text(count);
    for (size_t i = 0; i < part.size(); ++i) {
      value |= static_cast<uint32_t>(static_cast<uint8_t>(part[i])) << (8 * i);
    }
    return value;
  }
  float real() {
    const uint32_t bits = number(4);
    float value;
    std::memcpy(&value, &bits, 4);
    return value;
  }
  Vec3f vector() {
    const float x = real(), y = real(), z = real();
    return {x, y, z};
  }
  size_t left() const { return bytes_.size() - next_; }

 private:
  std::string bytes_;
  size_t next_ = 0;
};

void expectEqual(const Vec3f& actual, const Vec3f& expected) {
  EXPECT_EQ(actual.x, expected.x);
  EXPECT_EQ(actual.y, expected.y);
  EXPECT_EQ(actual.z, expected.z);
}

class MeshFile : public testing::Test {
 protected:
  std::string save(const std::string& name) {
    saveMesh(mesh_, MeshColour::kNormal, folder_ / name);
    return readBytes(folder_ / name);
  }

  TemporaryFolder folder_;
  Mesh mesh_ = makeMesh();
};

TEST_F(MeshFile, PlyHoldsPositionsNormalsColoursAndFaces) {
  const std::string content = save("mesh.ply");
  const std::string end = "end_header\n";
  const size_t body_at = content.find(end) + end.size();
  const std::string header = content.substr(0, body_at);
  EXPECT_EQ(header.find("ply\nformat binary_little_endian 1.0\n"), 0u);
  EXPECT_NE(header.find("element vertex 4\n"), std::string::npos);
  EXPECT_NE(header.find("element face 2\n"), std::string::npos);
  LittleEndianReader body(content.substr(body_at));
  for (size_t i = 0; i < mesh_.vertices_m.size(); ++i) {
    expectEqual(body.vector(), mesh_.vertices_m[i]);
    expectEqual(body.vector(), mesh_.normals[i]);
    for (uint8_t channel : vertexColour(MeshColour::kNormal, mesh_, i)) {
      EXPECT_EQ(body.number(1), channel);
    }
  }
  for (const auto& triangle : mesh_.triangles) {
    EXPECT_EQ(body.number(1), 3u);
    for (uint32_t index : triangle) EXPECT_EQ(body.number(4), index);
  }
  EXPECT_EQ(body.left(), 0u);
}

/// Positions far from the origin stay precise in .ply (doubles), .obj (more digits) and .glb (a
/// translation), but not in .stl (floats).
TEST_F(MeshFile, OnlyStlLosesPrecisionFarAway) {
  EXPECT_EQ(lossInFormat(mesh_, "mesh.stl"), "");
  mesh_.origin_m = {40000.0, -3.0, 0.0};
  mesh_.vertices_m[1].x = 0.0001f;
  for (const char* name : {"mesh.ply", "mesh.obj", "mesh.glb"}) {
    EXPECT_EQ(lossInFormat(mesh_, name), "") << name;
  }
  const std::string ply = save("mesh.ply");
  EXPECT_NE(ply.find("property double x\nproperty double y\nproperty double z\nproperty float nx"),
            std::string::npos);
  const size_t row = ply.find("end_header\n") + 11 + (3 * 8 + 3 * 4 + 3);
  double x_m;
  std::memcpy(&x_m, ply.data() + row, sizeof(x_m));
  EXPECT_NEAR(x_m, 40000.0001, 1e-9);

  const std::string obj = save("mesh.obj");
  double y_m = 0.0;
  EXPECT_EQ(
      std::sscanf(obj.c_str() + obj.find("\nv ", obj.find("\nv ") + 1), "\nv %lf %lf", &x_m, &y_m),
      2);
  EXPECT_NEAR(x_m, 40000.0001, 1e-9);
  EXPECT_EQ(y_m, -3.0);
  EXPECT_NE(obj.find("vn 0 0 1\n"), std::string::npos);

  const std::string glb = save("mesh.glb");
  EXPECT_NE(glb.find("\"translation\":[40000.0,"), std::string::npos);

  LittleEndianReader stl(save("mesh.stl"));
  stl.text(84 + 12);
  EXPECT_EQ(stl.real(), 40000.0f);
  const std::string loss = lossInFormat(mesh_, "mesh.stl");
  EXPECT_NE(loss.find(".stl files are floats"), std::string::npos) << loss;
  EXPECT_NE(loss.find(".ply"), std::string::npos) << loss;
}

TEST_F(MeshFile, ImageColoursAreSaved) {
  mesh_.colours = {{255, 0, 51, 255}, {1, 2, 3, 255}, {4, 5, 6, 255}, {0, 0, 0, 0}};
  saveMesh(mesh_, MeshColour::kAuto, folder_ / "mesh.ply");
  const std::string ply = readBytes(folder_ / "mesh.ply");
  const std::string body = ply.substr(ply.find("end_header\n") + 11);
  EXPECT_EQ(body.substr(24, 3), std::string("\xff\0\x33", 3));
  EXPECT_EQ(body.substr(27 + 24, 3), "\1\2\3");
  EXPECT_EQ(body.substr(3 * 27 + 24, 3), "\xc8\xc8\xc8");  // not painted
  saveMesh(mesh_, MeshColour::kAuto, folder_ / "mesh.obj");
  const std::string obj = readBytes(folder_ / "mesh.obj");
  const std::string first = obj.substr(obj.find("v "), obj.find('\n', obj.find("v ")) - 16);
  EXPECT_NE(first.find(" 1 0 0.2"), std::string::npos) << first;
}

TEST_F(MeshFile, ObjHoldsPositionsNormalsAndFaces) {
  std::istringstream in(save("mesh.obj"));
  std::vector<Vec3f> positions, normals;
  std::vector<std::string> faces;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string kind;
    Vec3f v;
    words >> kind;
    if (kind == "f") faces.push_back(line);
    if (kind != "v" && kind != "vn") continue;
    ASSERT_TRUE(words >> v.x >> v.y >> v.z) << line;
    (kind == "v" ? positions : normals).push_back(v);
  }
  ASSERT_EQ(positions.size(), mesh_.vertices_m.size());
  ASSERT_EQ(normals.size(), mesh_.normals.size());
  for (size_t i = 0; i < positions.size(); ++i) {
    expectEqual(positions[i], mesh_.vertices_m[i]);  // enough digits to restore the float exactly
    expectEqual(normals[i], mesh_.normals[i]);
  }
  EXPECT_EQ(faces, (std::vector<std::string>{"f 1//1 2//2 3//3", "f 1//1 3//3 4//4"}));
}

TEST_F(MeshFile, StlHoldsTrianglesAndTheirNormals) {
  LittleEndianReader bytes(save("mesh.stl"));
  EXPECT_NE(bytes.text(80).substr(0, 5), "solid");
  ASSERT_EQ(bytes.number(4), 2u);
  const Vec3f normals[] = {{0, 0, 1}, {-1, 0, 0}};
  for (size_t i = 0; i < 2; ++i) {
    expectEqual(bytes.vector(), normals[i]);
    for (uint32_t index : mesh_.triangles[i]) {
      expectEqual(bytes.vector(), mesh_.vertices_m[index]);
    }
    EXPECT_EQ(bytes.number(2), 0u);
  }
  EXPECT_EQ(bytes.left(), 0u);
}

TEST_F(MeshFile, ExtensionChoosesTheFormatIgnoringCase) {
  EXPECT_EQ(meshFormatOf("a/b.PLY"), ".ply");
  EXPECT_EQ(meshFormatOf("b.Obj"), ".obj");
  EXPECT_EQ(meshFormatOf("x.ply.stl"), ".stl");
  EXPECT_EQ(meshFormatOf("x.GLB"), ".glb");
  for (const char* path : {"", "ply", ".ply", "a.ply/b", "a.plyx", "a."}) {
    EXPECT_EQ(meshFormatOf(path), "") << path;
  }
}

/// An independent Python script reads both files and compares them.
TEST_F(MeshFile, GlbIsValidAndMatchesPly) {
  const auto expectAlike = [&](MeshColour colour) {
    const std::string glb = folder_ / "mesh.glb", ply = folder_ / "mesh.ply";
    saveMesh(mesh_, colour, glb);
    saveMesh(mesh_, colour, ply);
    EXPECT_EQ(std::system(("python3 -B " DTSDF_COMPARE_GLB " " + glb + " " + ply).c_str()), 0);
    EXPECT_LE(std::filesystem::file_size(glb),
              maxGlbBytes(mesh_.vertices_m.size(), mesh_.triangles.size()));
  };
  expectAlike(MeshColour::kNormal);
  mesh_.vertices_m.push_back({0.3f, 0.7f, 11.0f});  // odd numbers of vertices and triangles
  mesh_.normals.push_back({0, -1, 0});
  mesh_.triangles.push_back({{2, 3, 4}});
  mesh_.colours = {{255, 0, 51, 255}, {1, 2, 3, 255}, {4, 5, 6, 255}, {0, 0, 0, 0}, {9, 9, 9, 255}};
  expectAlike(MeshColour::kImage);
  mesh_.origin_m = {4.0e5, -3.0e6, 0.1};
  for (Vec3f& p : mesh_.vertices_m) p = {p.x + 5000.3f, p.y - 77.7f, p.z};
  expectAlike(MeshColour::kImage);
  // A normal of length 0, such as the mean of opposite normals, and a normal of length 5.
  mesh_.normals[0] = {0, 0, 0};
  mesh_.normals[1] = {0, 3, 4};
  expectAlike(MeshColour::kImage);
}

/// Tests only the size limit, without writing a file of that size.
TEST(Glb, HoldsSixtyMillionVertices) {
  EXPECT_LT(maxGlbBytes(60'000'000, 120'000'000), kMaxGlbBytes);
  EXPECT_GT(maxGlbBytes(80'000'000, 160'000'000), kMaxGlbBytes);
}

TEST_F(MeshFile, RefusesUnknownFormatsAndEmptyMeshes) {
  const std::string unknown = errorOf([&] { save("mesh.xyz"); });
  EXPECT_NE(unknown.find(".ply, .obj, .stl or .glb"), std::string::npos) << unknown;
  writeBytes(folder_ / "mesh.ply", "old");
  mesh_.triangles.clear();
  const std::string empty = errorOf([&] { save("mesh.ply"); });
  EXPECT_NE(empty.find("the mesh is empty"), std::string::npos) << empty;
  EXPECT_EQ(readBytes(folder_ / "mesh.ply"), "old");
}

}  // namespace
}  // namespace dtsdf
