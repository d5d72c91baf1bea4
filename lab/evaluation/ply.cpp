#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

#include "evaluation/triangle_mesh.h"
#include "io/atomic_file.h"
#include "io/little_endian.h"

namespace dtsdf {

namespace {

enum class Encoding { kAscii, kLittleEndian, kBigEndian };
/// All supported machines are little endian.
template <class Number>
double read(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof(number));
  return static_cast<double>(number);
}

struct NumberType {
  size_t bytes;
  double (*read)(const char* bytes);
};

template <class Number>
constexpr NumberType kType{sizeof(Number), read<Number>};

struct Property {
  std::string name;
  NumberType type;
  bool is_list = false;
  NumberType count_type = kType<uint8_t>;
};

struct Element {
  std::string name;
  size_t count = 0;
  std::vector<Property> properties;

  /// Index of a property, or -1.
  int find(const std::string& property_name) const {
    for (size_t i = 0; i < properties.size(); ++i) {
      if (properties[i].name == property_name) return static_cast<int>(i);
    }
    return -1;
  }
};

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
};

NumberType numberType(const std::string& name) {
  static const std::map<std::string, NumberType> types{
      {"char", kType<int8_t>},     {"int8", kType<int8_t>},     {"uchar", kType<uint8_t>},
      {"uint8", kType<uint8_t>},   {"short", kType<int16_t>},   {"int16", kType<int16_t>},
      {"ushort", kType<uint16_t>}, {"uint16", kType<uint16_t>}, {"int", kType<int32_t>},
      {"int32", kType<int32_t>},   {"uint", kType<uint32_t>},   {"uint32", kType<uint32_t>},
      {"float", kType<float>},     {"float32", kType<float>},   {"double", kType<double>},
      {"float64", kType<double>}};
  const auto type = types.find(name);
  if (type == types.end()) throw std::runtime_error("unknown type '" + name + "'");
  return type->second;
}

Encoding encodingFromName(const std::string& name) {
  if (name == "ascii") return Encoding::kAscii;
  if (name == "binary_little_endian") return Encoding::kLittleEndian;
  if (name == "binary_big_endian") return Encoding::kBigEndian;
  throw std::runtime_error("unknown format '" + name + "'");
}

Property readProperty(std::istringstream& words) {
  Property property;
  std::string type;
  words >> type;
  if (type == "list") {
    property.is_list = true;
    words >> type;
    property.count_type = numberType(type);
    words >> type;
  }
  property.type = numberType(type);
  words >> property.name;
  return property;
}

Header readHeader(std::istream& in) {
  Header header;
  std::string line;
  if (!std::getline(in, line) || line.substr(0, 3) != "ply") {
    throw std::runtime_error("not a PLY file");
  }
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "end_header") return header;
    if (word == "format") {
      words >> word;
      header.encoding = encodingFromName(word);
    } else if (word == "element") {
      Element element;
      words >> element.name >> element.count;
      if (!words) throw std::runtime_error("bad line '" + line + "'");
      const auto is_same = [&](const Element& other) { return other.name == element.name; };
      if (std::any_of(header.elements.begin(), header.elements.end(), is_same)) {
        throw std::runtime_error("element " + element.name + " occurs twice");
      }
      header.elements.push_back(element);
    } else if (word == "property") {
      if (header.elements.empty()) throw std::runtime_error("a property before any element");
      header.elements.back().properties.push_back(readProperty(words));
    }
  }
  throw std::runtime_error("the header has no end");
}

/// The numbers after the header, one at a time, whatever their encoding.
class NumberReader {
 public:
  NumberReader(std::istream& in, Encoding encoding) : encoding_(encoding) {
    data_.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    position_ = data_.data();
    end_ = data_.data() + data_.size();
  }

  double next(const NumberType& type) {
    return encoding_ == Encoding::kAscii ? text() : binary(type);
  }

 private:
  double text() {
    char* after = nullptr;
    // std::string ends with a null character, so the conversion stops there at the latest.
    const double number = std::strtod(position_, &after);
    if (after == position_)
      throw std::runtime_error("it ends too early or contains something that is not a number");
    position_ = after;
    return number;
  }

  double binary(const NumberType& type) {
    if (static_cast<size_t>(end_ - position_) < type.bytes) {
      throw std::runtime_error("it ends too early");
    }
    char bytes[8];
    std::memcpy(bytes, position_, type.bytes);
    position_ += type.bytes;
    if (encoding_ == Encoding::kBigEndian) std::reverse(bytes, bytes + type.bytes);
    return type.read(bytes);
  }

  Encoding encoding_;
  std::string data_;
  const char* position_;
  const char* end_;
};

/// Reads one row of an element: scalars into `scalars`, by property, lists into `lists`.
void readRow(const Element& element, NumberReader& reader, std::vector<double>& scalars,
             std::vector<std::vector<double>>& lists) {
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const Property& property = element.properties[i];
    if (!property.is_list) {
      scalars[i] = reader.next(property.type);
      continue;
    }
    const double count = reader.next(property.count_type);
    if (!(count >= 0.0 && count <= 1.0e6)) throw std::runtime_error("a list of impossible length");
    lists[i].resize(static_cast<size_t>(count));
    for (double& number : lists[i]) number = reader.next(property.type);
  }
}

uint8_t channelOf(double number) {
  if (!(number >= 0.0 && number < 256.0)) {
    throw std::runtime_error("a colour is not from 0 to 255");
  }
  return static_cast<uint8_t>(number);
}

void readVertices(const Element& element, NumberReader& reader, TriangleMesh& mesh) {
  const int x = element.find("x"), y = element.find("y"), z = element.find("z");
  if (x < 0 || y < 0 || z < 0) throw std::runtime_error("its vertices have no x, y and z");
  const int r = element.find("red"), g = element.find("green"), b = element.find("blue");
  const bool coloured = r >= 0 && g >= 0 && b >= 0;
  std::vector<double> row(element.properties.size());
  std::vector<std::vector<double>> lists(element.properties.size());
  for (size_t i = 0; i < element.count; ++i) {
    readRow(element, reader, row, lists);
    mesh.vertices.emplace_back(static_cast<float>(row[x]), static_cast<float>(row[y]),
                               static_cast<float>(row[z]));
    if (!mesh.vertices.back().allFinite()) {
      throw std::runtime_error("vertex " + std::to_string(i) + " is not finite");
    }
    if (coloured) mesh.colours.push_back({channelOf(row[r]), channelOf(row[g]), channelOf(row[b])});
  }
}

void readFaces(const Element& element, NumberReader& reader, TriangleMesh& mesh) {
  int corners = element.find("vertex_indices");
  if (corners < 0) corners = element.find("vertex_index");
  if (corners < 0 || !element.properties[static_cast<size_t>(corners)].is_list) {
    throw std::runtime_error("its faces have no list vertex_indices");
  }
  std::vector<double> row(element.properties.size());
  std::vector<std::vector<double>> lists(element.properties.size());
  for (size_t i = 0; i < element.count; ++i) {
    readRow(element, reader, row, lists);
    const std::vector<double>& polygon = lists[static_cast<size_t>(corners)];
    for (const double index : polygon) {
      if (!(index >= 0.0 && index < static_cast<double>(mesh.vertices.size()))) {
        throw std::runtime_error("face " + std::to_string(i) + " has a vertex that does not exist");
      }
    }
    for (size_t k = 2; k < polygon.size(); ++k) {
      mesh.triangles.push_back({static_cast<uint32_t>(polygon[0]),
                                static_cast<uint32_t>(polygon[k - 1]),
                                static_cast<uint32_t>(polygon[k])});
    }
  }
}

void skipElement(const Element& element, NumberReader& reader) {
  if (element.properties.empty()) return;  // however many there are, they take no room
  std::vector<double> row(element.properties.size());
  std::vector<std::vector<double>> lists(element.properties.size());
  for (size_t i = 0; i < element.count; ++i) readRow(element, reader, row, lists);
}

template <class Number>
void append(std::string& bytes, Number number) {
  for (const uint8_t byte : littleEndianBytes(number)) bytes += static_cast<char>(byte);
}

}  // namespace

TriangleMesh readPly(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) throw std::runtime_error(path + ": is not a file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path + ": cannot be opened");
  try {
    const Header header = readHeader(in);
    NumberReader reader(in, header.encoding);
    TriangleMesh mesh;
    for (const Element& element : header.elements) {
      if (element.name == "vertex") {
        readVertices(element, reader, mesh);
      } else if (element.name == "face") {
        readFaces(element, reader, mesh);
      } else {
        skipElement(element, reader);
      }
    }
    return mesh;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

void writePly(const std::string& path, const TriangleMesh& mesh) {
  const bool coloured = !mesh.colours.empty();
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(mesh.vertices.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\n";
  if (coloured) bytes += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  bytes += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) append(bytes, mesh.vertices[i][axis]);
    if (!coloured) continue;
    for (const uint8_t channel : mesh.colours[i]) append(bytes, channel);
  }
  for (const auto& triangle : mesh.triangles) {
    append(bytes, uint8_t{3});
    for (const uint32_t index : triangle) append(bytes, static_cast<int32_t>(index));
  }
  writeFileAtomically(path, bytes);
}

}  // namespace dtsdf
