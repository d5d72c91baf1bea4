#include "unit/io/glb_rules.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

namespace dtsdf {
namespace {

using nlohmann::json;

struct Component {
  size_t bytes;
  bool is_float;
};

const std::map<int, Component> kComponents = {{5120, {1, false}}, {5121, {1, false}},
                                              {5122, {2, false}}, {5123, {2, false}},
                                              {5125, {4, false}}, {5126, {4, true}}};
const std::map<std::string, size_t> kWidths = {
    {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
constexpr int kVertexTarget = 34962, kIndexTarget = 34963;

class Rules {
 public:
  explicit Rules(const std::string& bytes) : bytes_(bytes) {}

  std::vector<std::string> check() {
    if (!readChunks()) return problems_;
    checkAsset();
    checkViews();
    checkNodes();
    checkPrimitive();
    checkUse();
    return problems_;
  }

 private:
  struct Accessor {
    json entry = json::object();
    std::vector<double> values;  ///< Normalised ones as shares of 1.
    size_t width = 0;
    size_t count() const { return entry.value("count", size_t{0}); }
  };

  void require(bool holds, const std::string& rule) {
    if (!holds) problems_.push_back(rule);
  }

  uint32_t word(size_t at) const {
    uint32_t value = 0;
    for (size_t i = 0; i < 4 && at + i < bytes_.size(); ++i) {
      value |= static_cast<uint32_t>(static_cast<uint8_t>(bytes_[at + i])) << (8 * i);
    }
    return value;
  }

  /// A header, a JSON chunk padded by spaces, a binary chunk padded by zeros, nothing else.
  bool readChunks() {
    require(bytes_.substr(0, 4) == "glTF" && word(4) == 2, "header");
    require(word(8) == bytes_.size(), "length of the file");
    const size_t json_bytes = word(12), binary_at = 20 + json_bytes;
    require(bytes_.substr(16, 4) == "JSON" && json_bytes % 4 == 0, "JSON chunk");
    require(bytes_.substr(binary_at + 4, 4) == std::string("BIN\0", 4), "binary chunk");
    require(word(binary_at) % 4 == 0, "alignment of the binary chunk");
    require(binary_at + 8 + word(binary_at) == bytes_.size(), "length of the binary chunk");
    if (!problems_.empty()) return false;
    document_ = json::parse(bytes_.substr(20, json_bytes), nullptr, false);
    require(document_.is_object() && bytes_[20] == '{', "JSON");
    binary_ = bytes_.substr(binary_at + 8);
    return problems_.empty();
  }

  void checkAsset() {
    require(document_["asset"].value("version", "") == "2.0", "asset/version");
    const std::set<std::string> known = {"asset",     "scene",       "scenes",
                                         "nodes",     "meshes",      "materials",
                                         "accessors", "bufferViews", "buffers"};
    for (const auto& [name, value] : document_.items()) {
      require(known.count(name) > 0, "unexpected property " + name);
      require(!value.is_array() || !value.empty(), "empty array " + name);
    }
  }

  /// Views lie one behind the other, and no byte of the buffer belongs to none.
  void checkViews() {
    require(document_["buffers"].size() == 1, "one buffer");
    const size_t length = document_["buffers"][0].value("byteLength", size_t{0});
    require(length <= binary_.size() && binary_.size() - length < 4, "buffer/byteLength");
    require(
        std::all_of(binary_.begin() + static_cast<std::ptrdiff_t>(std::min(length, binary_.size())),
                    binary_.end(), [](char c) { return c == 0; }),
        "padding of the buffer");
    size_t end = 0;
    for (const json& view : document_["bufferViews"]) {
      const size_t at = view.value("byteOffset", size_t{0});
      require(view.value("buffer", -1) == 0, "bufferView/buffer");
      require(at % 4 == 0, "alignment of a bufferView");
      require(at == end, "bufferViews overlap or leave bytes out");
      const int target = view.value("target", 0);
      require(target == kVertexTarget || target == kIndexTarget, "bufferView/target");
      end = at + view.value("byteLength", size_t{0});
    }
    require(end == length, "bufferViews and the buffer's length");
  }

  double component(const char* at, int type, bool normalized) const {
    if (type == 5126) {
      float value;
      std::memcpy(&value, at, sizeof(value));
      return static_cast<double>(value);
    }
    uint32_t value = 0;
    const size_t bytes = kComponents.at(type).bytes;
    for (size_t i = 0; i < bytes; ++i) {
      value |= static_cast<uint32_t>(static_cast<uint8_t>(at[i])) << (8 * i);
    }
    return normalized ? value / (std::pow(256.0, static_cast<double>(bytes)) - 1.0) : value;
  }

  Accessor read(const json& number, int target) {
    Accessor result;
    const size_t index = number.is_number_unsigned() ? number.get<size_t>() : SIZE_MAX;
    require(index < document_["accessors"].size(), "index of an accessor");
    if (index >= document_["accessors"].size()) return result;
    require(used_accessors_.insert(index).second, "an accessor is used twice");
    result.entry = document_["accessors"][index];
    const int type = result.entry.value("componentType", 0);
    const std::string kind = result.entry.value("type", "");
    const size_t view_index = result.entry.value("bufferView", SIZE_MAX);
    if (kComponents.count(type) == 0 || kWidths.count(kind) == 0 ||
        view_index >= document_["bufferViews"].size()) {
      require(false, "type or view of an accessor");
      return result;
    }
    used_views_.insert(view_index);
    const json& view = document_["bufferViews"][view_index];
    require(view.value("target", 0) == target, "target of an accessor's view");
    result.width = kWidths.at(kind);
    const size_t count = result.entry.value("count", size_t{0});
    const size_t bytes = kComponents.at(type).bytes, row = bytes * result.width;
    const size_t at =
        view.value("byteOffset", size_t{0}) + result.entry.value("byteOffset", size_t{0});
    const bool normalized = result.entry.value("normalized", false);
    require(count > 0, "accessor/count");
    require(at % bytes == 0 && (target == kIndexTarget || row % 4 == 0),
            "alignment of an accessor");
    require(!normalized || !kComponents.at(type).is_float, "accessor/normalized of floats");
    require(!view.contains("byteStride"), "byteStride where rows are dense");
    const bool fits =
        row * count == view.value("byteLength", size_t{0}) && at + row * count <= binary_.size();
    require(fits, "an accessor and the length of its view");
    for (size_t i = 0; fits && i < count * result.width; ++i) {
      result.values.push_back(component(&binary_[at + i * bytes], type, normalized));
      require(std::isfinite(result.values.back()), "a number is not finite");
    }
    return result;
  }

  void checkPrimitive() {
    require(document_["meshes"].size() == 1, "one mesh");
    const json& primitives = document_["meshes"][0]["primitives"];
    require(primitives.size() == 1 && primitives[0].value("mode", 4) == 4, "one list of triangles");
    const json& attributes = primitives[0]["attributes"];
    for (const char* const name : {"POSITION", "NORMAL", "COLOR_0"}) {
      require(attributes.contains(name), std::string("no ") + name);
      if (!attributes.contains(name)) return;
    }
    require(attributes.size() == 3, "another attribute");
    const Accessor positions = read(attributes["POSITION"], kVertexTarget);
    checkPositions(positions);
    checkNormals(read(attributes["NORMAL"], kVertexTarget), positions.count());
    checkColours(read(attributes["COLOR_0"], kVertexTarget), positions.count());
    checkIndices(read(primitives[0]["indices"], kIndexTarget), positions.count());
    checkMaterial(primitives[0]);
  }

  void checkPositions(const Accessor& positions) {
    require(positions.width == 3 && positions.entry.value("componentType", 0) == 5126,
            "type of POSITION");
    const json low = positions.entry.value("min", json()),
               high = positions.entry.value("max", json());
    require(low.size() == 3 && high.size() == 3, "POSITION has no min and max");
    if (positions.width != 3 || low.size() != 3 || high.size() != 3) return;
    for (size_t axis = 0; axis < 3; ++axis) {
      double least = INFINITY, most = -INFINITY;
      for (size_t i = axis; i < positions.values.size(); i += 3) {
        least = std::min(least, positions.values[i]);
        most = std::max(most, positions.values[i]);
      }
      require(low[axis].get<double>() == least && high[axis].get<double>() == most,
              "min and max of POSITION");
    }
  }

  void checkNormals(const Accessor& normals, size_t vertices) {
    require(normals.width == 3 && normals.entry.value("componentType", 0) == 5126,
            "type of NORMAL");
    require(normals.count() == vertices, "count of NORMAL");
    for (size_t i = 0; i + 2 < normals.values.size(); i += 3) {
      const double length =
          std::hypot(normals.values[i], normals.values[i + 1], normals.values[i + 2]);
      require(std::abs(length - 1.0) < 5e-4, "length of a NORMAL");
    }
  }

  /// Whole numbers of 16 bits are allowed, but trimesh takes the lower 8 of them.
  void checkColours(const Accessor& colours, size_t vertices) {
    const int type = colours.entry.value("componentType", 0);
    require(colours.width == 3 || colours.width == 4, "type of COLOR_0");
    require(type == 5126 || (type == 5121 && colours.entry.value("normalized", false)),
            "componentType of COLOR_0");
    require(colours.count() == vertices, "count of COLOR_0");
    for (const double value : colours.values) {
      require(value >= 0.0 && value <= 1.0, "range of COLOR_0");
    }
  }

  void checkIndices(const Accessor& indices, size_t vertices) {
    const int type = indices.entry.value("componentType", 0);
    require(indices.width == 1 && (type == 5121 || type == 5123 || type == 5125),
            "type of the indices");
    require(!indices.entry.contains("normalized"), "normalized indices");
    require(indices.count() % 3 == 0, "count of the indices");
    std::set<double> named(indices.values.begin(), indices.values.end());
    require(!named.empty() && *named.rbegin() < static_cast<double>(vertices),
            "range of the indices");
    require(named.size() == vertices, "a vertex is in no triangle");
  }

  /// A viewer multiplies COLOR_0 with these; metal would be black where nothing is mirrored.
  void checkMaterial(const json& primitive) {
    const size_t index = primitive.value("material", SIZE_MAX);
    require(index < document_["materials"].size() && document_["materials"].size() == 1,
            "material");
    if (index >= document_["materials"].size()) return;
    const json& material = document_["materials"][index];
    const json surface = material.value("pbrMetallicRoughness", json::object());
    require(surface.value("metallicFactor", 1.0) == 0.0, "a metal");
    require(surface.value("baseColorFactor", json({1, 1, 1, 1})) == json({1, 1, 1, 1}),
            "base colour is not white");
    require(material.value("doubleSided", false), "one side does not show");
    require(material.value("alphaMode", "OPAQUE") == "OPAQUE", "alphaMode");
  }

  /// Every node is reached once from the scene, and the mesh by one of them.
  void checkNodes() {
    require(document_.value("scene", -1) == 0 && document_["scenes"].size() == 1, "scene");
    size_t meshes = 0;
    std::vector<size_t> open = document_["scenes"][0].value("nodes", std::vector<size_t>());
    std::set<size_t> seen;
    while (!open.empty()) {
      const size_t index = open.back();
      open.pop_back();
      require(index < document_["nodes"].size(), "index of a node");
      require(seen.insert(index).second, "a node is reached twice");
      if (index >= document_["nodes"].size() || seen.size() > document_["nodes"].size()) return;
      const json& node = document_["nodes"][index];
      if (node.contains("mesh")) ++meshes;
      double length = 0.0;
      for (const double q : node.value("rotation", std::vector<double>{0, 0, 0, 1}))
        length += q * q;
      require(std::abs(length - 1.0) < 1e-6, "length of a rotation");
      for (const size_t child : node.value("children", std::vector<size_t>()))
        open.push_back(child);
    }
    require(seen.size() == document_["nodes"].size(), "a node is not used");
    require(meshes == 1, "the mesh is not used once");
  }

  void checkUse() {
    require(used_accessors_.size() == document_["accessors"].size(), "an accessor is not used");
    require(used_views_.size() == document_["bufferViews"].size(), "a bufferView is not used");
  }

  const std::string& bytes_;
  std::string binary_;
  json document_;
  std::set<size_t> used_accessors_, used_views_;
  std::vector<std::string> problems_;
};

}  // namespace

std::vector<std::string> glbProblems(const std::string& bytes) { return Rules(bytes).check(); }

}  // namespace dtsdf
