#include "io/glb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/mesh_file.h"
#include "support/temporary_folder.h"
#include "unit/io/glb_rules.h"

namespace dtsdf {
namespace {

using nlohmann::json;
using Problems = std::vector<std::string>;

/// Two triangles, and a third for an odd number of everything.
Mesh makePaintedMesh() {
  Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, -0.1f}, {0.3f, 0.7f, 11.0f}};
  mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0.6f, 0.8f}, {1, 0, 0}, {0, -1, 0}};
  mesh.triangles = {{{0, 1, 2}}, {{0, 2, 3}}, {{2, 3, 4}}};
  mesh.colours = {{255, 0, 51, 255}, {1, 2, 3, 255}, {4, 5, 6, 255}, {0, 0, 0, 0}, {9, 9, 9, 255}};
  return mesh;
}

std::string glbOf(const Mesh& mesh, MeshColour colour = MeshColour::kImage) {
  const TemporaryFolder folder;
  saveMesh(mesh, colour, folder / "mesh.glb");
  return readBytes(folder / "mesh.glb");
}

std::string asWord(size_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(value >> (8 * i) & 255));
  return bytes;
}

/// The same file with another document.
std::string withDocument(const std::string& glb, const std::function<void(json&)>& change) {
  const size_t bytes =
      static_cast<uint8_t>(glb[12]) | static_cast<size_t>(static_cast<uint8_t>(glb[13])) << 8;
  json document = json::parse(glb.substr(20, bytes));
  change(document);
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::string rest = glb.substr(20 + bytes);
  return glb.substr(0, 8) + asWord(20 + text.size() + rest.size()) + asWord(text.size()) + "JSON" +
         text + rest;
}

TEST(Glb, KeepsTheRulesOfTheFormat) {
  Mesh mesh = makePaintedMesh();
  EXPECT_EQ(glbProblems(glbOf(mesh)), Problems());
  EXPECT_EQ(glbProblems(glbOf(mesh, MeshColour::kNormal)), Problems());
  mesh.origin_m = {4.0e5, -3.0e6, 0.1};
  for (Vec3f& p : mesh.vertices_m) p = {p.x + 5000.3f, p.y - 77.7f, p.z};
  EXPECT_EQ(glbProblems(glbOf(mesh)), Problems());
  mesh.vertices_m.resize(3);
  mesh.normals.resize(3);
  mesh.triangles.resize(1);
  mesh.colours.clear();
  EXPECT_EQ(glbProblems(glbOf(mesh, MeshColour::kNormal)), Problems());
}

/// As averages of opposite ones are, where a surface is as thin as a voxel.
TEST(Glb, NormalsHaveLengthOne) {
  Mesh mesh = makePaintedMesh();
  mesh.normals[0] = {0, 0, 0};
  mesh.normals[1] = {0, 3, 4};
  EXPECT_EQ(glbProblems(glbOf(mesh)), Problems());
}

/// A check that finds nothing wrong would not see these either.
TEST(GlbRules, WhatIsWrongIsFound) {
  const std::string glb = glbOf(makePaintedMesh());
  struct Fault {
    std::string problem;
    std::function<void(json&)> change;
  };
  const std::vector<Fault> faults = {
      {"asset/version", [](json& d) { d["asset"]["version"] = "1.0"; }},
      {"min and max of POSITION", [](json& d) { d["accessors"][0]["max"][1] = 1.5; }},
      {"POSITION has no min and max", [](json& d) { d["accessors"][0].erase("min"); }},
      {"bufferView/target", [](json& d) { d["bufferViews"][2].erase("target"); }},
      {"target of an accessor's view", [](json& d) { d["bufferViews"][3]["target"] = 34962; }},
      {"bufferViews overlap or leave bytes out",
       [](json& d) { d["bufferViews"][1]["byteOffset"] = 56; }},
      {"alignment of a bufferView", [](json& d) { d["bufferViews"][1]["byteOffset"] = 61; }},
      {"buffer/byteLength", [](json& d) { d["buffers"][0]["byteLength"] = 1000; }},
      {"no COLOR_0",
       [](json& d) { d["meshes"][0]["primitives"][0]["attributes"].erase("COLOR_0"); }},
      {"componentType of COLOR_0", [](json& d) { d["accessors"][2]["componentType"] = 5123; }},
      {"accessor/normalized of floats", [](json& d) { d["accessors"][2]["normalized"] = true; }},
      {"an accessor and the length of its view", [](json& d) { d["accessors"][1]["count"] = 4; }},
      {"count of the indices", [](json& d) { d["accessors"][3]["count"] = 8; }},
      {"material", [](json& d) { d["meshes"][0]["primitives"][0].erase("material"); }},
      {"a metal",
       [](json& d) { d["materials"][0]["pbrMetallicRoughness"].erase("metallicFactor"); }},
      {"one side does not show", [](json& d) { d["materials"][0].erase("doubleSided"); }},
      {"length of a rotation", [](json& d) { d["nodes"][0]["rotation"][3] = 1.0; }},
      {"a node is not used", [](json& d) { d["nodes"].push_back(json::object()); }},
      {"an accessor is not used", [](json& d) { d["accessors"].push_back(d["accessors"][1]); }},
      {"unexpected property extensionsUsed", [](json& d) { d["extensionsUsed"] = {"X"}; }}};
  for (const Fault& fault : faults) {
    const Problems found = glbProblems(withDocument(glb, fault.change));
    EXPECT_NE(std::find(found.begin(), found.end(), fault.problem), found.end()) << fault.problem;
  }
  EXPECT_EQ(glbProblems(withDocument(glb, [](json&) {})), Problems());
  EXPECT_EQ(glbProblems(glb + "0"), Problems({"length of the file", "length of the binary chunk"}));
}

}  // namespace
}  // namespace dtsdf
