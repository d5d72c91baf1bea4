#include "io/glb.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "io/little_endian.h"

namespace dtsdf {
namespace {

using nlohmann::json;

// Constants from the glTF specification.
constexpr uint32_t kGlbMagic = 0x46546c67, kGlbVersion = 2;          // "glTF"
constexpr uint32_t kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;  // "JSON", "BIN"
constexpr int kUnsignedInt = 5125, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr uint64_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

// Without textures, a vertex consists of a position, a normal and a colour, three floats each; a
// triangle consists of three 32-bit indices. Colours are floats because 8 bits of linear light are
// too few in dark areas, and trimesh reads only the lower 8 of 16 bits.
constexpr uint64_t kVectorBytes = 12, kTriangleBytes = 12;
constexpr uint64_t kMaxJsonBytes = 4096;

/// The corners of the vertices' bounding box.
std::pair<Vec3f, Vec3f> boundsOf(const Mesh& mesh) {
  Vec3f low = mesh.vertices_m.front(), high = low;
  for (const Vec3f& p : mesh.vertices_m) {
    low = minOf(low, p);
    high = maxOf(high, p);
  }
  return {low, high};
}

/// The origin of positions in the file, relative to the mesh's own origin: the centre of the mesh,
/// rounded to whole metres, which floats represent exactly.
Vec3f originOf(const Mesh& mesh) {
  const auto [low, high] = boundsOf(mesh);
  const Vec3f middle = 0.5f * low + 0.5f * high;
  return {std::round(middle.x), std::round(middle.y), std::round(middle.z)};
}

json toJson(const Vec3f& v) { return json::array({v.x, v.y, v.z}); }

/// A document with a scene and a mesh that has no primitives yet.
json documentOf(const Mesh& mesh, const Vec3f& origin) {
  json document;
  document["asset"] = {{"version", "2.0"}, {"generator", "dtsdf_mapping"}};
  document["scene"] = 0;
  document["scenes"] = json::array({json{{"nodes", json::array({0})}}});
  const double half = std::sqrt(0.5);
  const json root = {{"name", "y_up"},
                     {"rotation", json::array({-half, 0.0, 0.0, half})},
                     {"children", json::array({1})}};
  const json translation = json::array({mesh.origin_m[0] + static_cast<double>(origin.x),
                                        mesh.origin_m[1] + static_cast<double>(origin.y),
                                        mesh.origin_m[2] + static_cast<double>(origin.z)});
  const json map = {{"name", "map"}, {"translation", translation}, {"mesh", 0}};
  document["nodes"] = json::array({root, map});
  document["meshes"] = json::array({json{{"name", "map"}}});
  return document;
}

/// Adds a buffer view after the existing ones.
json& addView(uint64_t bytes, json& document) {
  json& buffer = document["buffers"][0]["byteLength"];
  const uint64_t at = buffer.is_null() ? 0 : buffer.get<uint64_t>();
  buffer = at + bytes;
  document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes}});
  return document["bufferViews"].back();
}

/// Adds an accessor for float vectors, and its buffer view. @return the accessor.
json& addVectors(uint64_t count, uint64_t dimensions, json& document) {
  document["accessors"].push_back({{"bufferView", document["bufferViews"].size()},
                                   {"count", count},
                                   {"componentType", kFloat},
                                   {"type", "VEC" + std::to_string(dimensions)}});
  addView(sizeof(float) * dimensions * count, document)["target"] = kArrayBuffer;
  return document["accessors"].back();
}

const json& matteMaterial() {
  static const json surface = {
      {"name", "surface"},
      {"doubleSided", true},
      {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}};
  return surface;
}

std::string paddedText(const json& document) {
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  return text;
}

std::string describe(const Mesh& mesh, const Vec3f& origin) {
  const uint64_t vertices = mesh.vertices_m.size(), triangles = mesh.triangles.size();
  json document = documentOf(mesh, origin);
  document["meshes"][0]["primitives"].push_back(
      {{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}}},
       {"indices", 3},
       {"material", 0},
       {"mode", 4}});
  document["materials"] = json::array({matteMaterial()});
  json& positions = addVectors(vertices, 3, document);
  // Rounding in the subtraction of `origin` is monotonic, so the bounds remain exact.
  const auto [low, high] = boundsOf(mesh);
  positions["min"] = toJson(low - origin);
  positions["max"] = toJson(high - origin);
  addVectors(vertices, 3, document);
  addVectors(vertices, 3, document);
  document["accessors"].push_back({{"bufferView", 3},
                                   {"count", 3 * triangles},
                                   {"componentType", kUnsignedInt},
                                   {"type", "SCALAR"}});
  addView(kTriangleBytes * triangles, document)["target"] = kElementArrayBuffer;
  return paddedText(document);
}

/// Normalises a normal, as glTF requires; a zero normal is replaced by one that points up.
Vec3f unitNormal(const Vec3f& n) {
  const float length = norm(n);
  if (std::abs(length - 1.0f) < 1e-4f) return n;
  return length > 0.0f ? (1.0f / length) * n : Vec3f{0.0f, 0.0f, 1.0f};
}

/// Linear intensity, 0 to 1, for each 8-bit sRGB value.
std::array<float, 256> linearLight() {
  std::array<float, 256> table = {};
  for (size_t i = 0; i < table.size(); ++i) {
    const double value = static_cast<double>(i) / 255.0;
    const double light = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    table[i] = static_cast<float>(light);
  }
  return table;
}

/// Writes everything that precedes the buffer; `bytes` is the buffer's size.
void beginGlb(const std::string& text, uint64_t bytes, AtomicFile& file) {
  put(file, kGlbMagic);
  put(file, kGlbVersion);
  put(file, static_cast<uint32_t>(kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + bytes));
  put(file, static_cast<uint32_t>(text.size()));
  put(file, kJsonChunk);
  file.write(text);
  put(file, static_cast<uint32_t>(bytes));
  put(file, kBinChunk);
}

uint64_t bufferBytes(uint64_t vertices, uint64_t triangles) {
  return 3 * kVectorBytes * vertices + kTriangleBytes * triangles;
}

}  // namespace

uint64_t maxGlbBytes(uint64_t vertices, uint64_t triangles) {
  return kHeaderBytes + 2 * kChunkHeaderBytes + kMaxJsonBytes + bufferBytes(vertices, triangles);
}

void writeGlb(const Mesh& mesh, MeshColour colour, AtomicFile& file) {
  const Vec3f origin = originOf(mesh);
  const std::string text = describe(mesh, origin);
  const uint64_t bytes = bufferBytes(mesh.vertices_m.size(), mesh.triangles.size());
  beginGlb(text, bytes, file);
  for (const Vec3f& p : mesh.vertices_m) put(file, p - origin);
  for (const Vec3f& n : mesh.normals) put(file, unitNormal(n));
  const std::array<float, 256> light = linearLight();
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    for (const uint8_t channel : vertexColour(colour, mesh, i)) put(file, light[channel]);
  }
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t index : triangle) put(file, index);
  }
}

namespace {

/// Returns the JSON text and sets `bytes` to the buffer's size. For each texture page, the buffer
/// contains its triangles' corners: positions, normals and texture coordinates. All images follow.
std::string describe(const TexturedMesh& textured, const Vec3f& origin, uint64_t& bytes) {
  json document = documentOf(textured.mesh, origin);
  json& primitives = document["meshes"][0]["primitives"];
  size_t end = 0;  // end of the page's triangles
  for (size_t i = 0; i < textured.pages.size(); ++i) {
    const uint64_t corners = 3 * textured.page_triangles[i];
    const size_t begin = std::exchange(end, end + textured.page_triangles[i]);
    const Mesh& mesh = textured.mesh;
    Vec3f low = mesh.vertices_m[mesh.triangles[begin][0]], high = low;
    for (size_t triangle = begin; triangle < end; ++triangle) {
      for (const uint32_t corner : mesh.triangles[triangle]) {
        low = minOf(low, mesh.vertices_m[corner]);
        high = maxOf(high, mesh.vertices_m[corner]);
      }
    }
    json& positions = addVectors(corners, 3, document);
    positions["min"] = toJson(low - origin);
    positions["max"] = toJson(high - origin);
    addVectors(corners, 3, document);
    addVectors(corners, 2, document);
    const size_t first = 3 * i;
    primitives.push_back(
        {{"attributes", {{"POSITION", first}, {"NORMAL", first + 1}, {"TEXCOORD_0", first + 2}}},
         {"material", i},
         {"mode", 4}});
    document["textures"].push_back({{"source", i}, {"sampler", 0}});
    json material = matteMaterial();
    material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", i}};
    material["extensions"]["KHR_materials_unlit"] = json::object();
    document["materials"].push_back(material);
  }
  for (const std::string& png : textured.pages) {
    document["images"].push_back(
        {{"bufferView", document["bufferViews"].size()}, {"mimeType", "image/png"}});
    addView(png.size(), document);
    json& buffer = document["buffers"][0]["byteLength"];
    buffer = (buffer.get<uint64_t>() + 3) / 4 * 4;
  }
  document["extensionsUsed"] = json::array({"KHR_materials_unlit"});
  constexpr int kLinear = 9729, kClampToEdge = 33071;
  document["samplers"] = json::array({json{{"magFilter", kLinear},
                                           {"minFilter", kLinear},
                                           {"wrapS", kClampToEdge},
                                           {"wrapT", kClampToEdge}}});
  bytes = document["buffers"][0]["byteLength"].get<uint64_t>();
  return paddedText(document);
}

}  // namespace

void writeGlb(const TexturedMesh& textured, AtomicFile& file) {
  const Mesh& mesh = textured.mesh;
  const Vec3f origin = originOf(mesh);
  uint64_t bytes = 0;
  const std::string text = describe(textured, origin, bytes);
  if (kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + bytes > kMaxGlbBytes) {
    throw std::runtime_error(
        "the mesh and its textures do not fit in a .glb file (at most 4 GiB); save "
        "an .obj file, or use larger texels");
  }
  beginGlb(text, bytes, file);
  size_t begin = 0;
  for (const size_t triangles : textured.page_triangles) {
    const size_t end = begin + triangles;
    const auto put_corners = [&](const auto& put_corner) {
      for (size_t i = begin; i < end; ++i) {
        for (size_t corner = 0; corner < 3; ++corner) put_corner(i, corner);
      }
    };
    put_corners([&](size_t i, size_t corner) {
      put(file, mesh.vertices_m[mesh.triangles[i][corner]] - origin);
    });
    put_corners([&](size_t i, size_t corner) {
      put(file, unitNormal(mesh.normals[mesh.triangles[i][corner]]));
    });
    put_corners([&](size_t i, size_t corner) {
      for (const float share : textured.places[i][corner]) put(file, share);
    });
    begin = end;
  }
  for (const std::string& png : textured.pages) {
    file.write(png);
    file.write(std::string((4 - png.size() % 4) % 4, '\0'));
  }
}

}  // namespace dtsdf
