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

/// All supported machines are little-endian, like the files.
template <class Number>
double read(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof(number));
  return static_cast<double>(number);
}

struct NumberType {
  size_t bytes = 0;
  double (*read)(const char* bytes) = nullptr;
};

template <class Number>
constexpr NumberType kType{sizeof(Number), read<Number>};

struct Property {
  std::string name;
  NumberType type;
};

struct Header {
  bool is_ascii = false;
  size_t vertices = 0, faces = 0;
  std::vector<Property> vertex_properties;
  NumberType corner_count, corner;  ///< Types in the list of corners of a face.
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

/// Reads the rest of a header line that starts with "property".
void readProperty(std::istringstream& words, const std::string& element, Header& header) {
  std::string type, name;
  words >> type;
  if (element == "vertex") {
    words >> name;
    header.vertex_properties.push_back({name, numberType(type)});
    return;
  }
  std::string count_type;
  if (type == "list") words >> count_type >> type >> name;
  if (name != "vertex_indices" && name != "vertex_index") {
    throw std::runtime_error("faces may only have the property vertex_indices, a list");
  }
  header.corner_count = numberType(count_type);
  header.corner = numberType(type);
}

Header readHeader(std::istream& in) {
  Header header;
  std::string line, word, element;
  if (!std::getline(in, line) || line.substr(0, 3) != "ply") {
    throw std::runtime_error("not a PLY file");
  }
  while (std::getline(in, line)) {
    std::istringstream words(line);
    words >> word;
    if (word == "end_header") return header;
    if (word == "format") {
      words >> word;
      header.is_ascii = word == "ascii";
      if (!header.is_ascii && word != "binary_little_endian") {
        throw std::runtime_error("format '" + word + "' is not supported");
      }
    } else if (word == "element") {
      size_t count = 0;
      words >> element >> count;
      if (!words || (element != "vertex" && element != "face") ||
          (element == "vertex" && header.corner.read != nullptr)) {
        throw std::runtime_error("'" + line + "' is not supported; expected vertices, then faces");
      }
      (element == "vertex" ? header.vertices : header.faces) = count;
    } else if (word == "property") {
      readProperty(words, element, header);
    }
  }
  throw std::runtime_error("the header has no end_header line");
}

/// Reads the numbers that follow the header, one at a time.
class NumberReader {
 public:
  NumberReader(std::istream& in, bool is_ascii)
      : is_ascii_(is_ascii),
        data_(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()) {}

  double next(const NumberType& type) { return is_ascii_ ? text() : binary(type); }

 private:
  double text() {
    char* after = nullptr;
    // std::string ends with a null character, so the conversion never reads past its end.
    const double number = std::strtod(position_, &after);
    if (after == position_) {
      throw std::runtime_error("the file is too short or contains an invalid number");
    }
    position_ = after;
    return number;
  }

  double binary(const NumberType& type) {
    if (static_cast<size_t>(end_ - position_) < type.bytes) {
      throw std::runtime_error("the file is too short");
    }
    const double number = type.read(position_);
    position_ += type.bytes;
    return number;
  }

  bool is_ascii_;
  std::string data_;
  const char* position_ = data_.data();
  const char* const end_ = position_ + data_.size();
};

uint8_t channelOf(double number) {
  if (!(number >= 0.0 && number < 256.0)) {
    throw std::runtime_error("a colour is outside the range 0 to 255");
  }
  return static_cast<uint8_t>(number);
}

void readVertices(const Header& header, NumberReader& reader, TriangleMesh& mesh) {
  std::map<std::string, double> row;
  for (const Property& property : header.vertex_properties) row[property.name] = 0.0;
  for (const char* name : {"x", "y", "z"}) {
    if (row.count(name) == 0) throw std::runtime_error("the vertices have no x, y and z");
  }
  const bool is_coloured = row.count("red") > 0 && row.count("green") > 0 && row.count("blue") > 0;
  std::vector<double*> cells;
  for (const Property& property : header.vertex_properties) cells.push_back(&row[property.name]);
  const double &x = row["x"], &y = row["y"], &z = row["z"];
  const double &red = row["red"], &green = row["green"], &blue = row["blue"];
  for (size_t i = 0; i < header.vertices; ++i) {
    for (size_t k = 0; k < cells.size(); ++k) {
      *cells[k] = reader.next(header.vertex_properties[k].type);
    }
    mesh.vertices.push_back(Eigen::Vector3d(x, y, z).cast<float>());
    if (!mesh.vertices.back().allFinite()) {
      throw std::runtime_error("vertex " + std::to_string(i) + " is not finite");
    }
    if (is_coloured) {
      mesh.colours.push_back({channelOf(red), channelOf(green), channelOf(blue)});
    }
  }
}

void readFaces(const Header& header, NumberReader& reader, TriangleMesh& mesh) {
  if (header.faces > 0 && header.corner.read == nullptr) {
    throw std::runtime_error("the faces have no list vertex_indices");
  }
  std::vector<double> polygon;
  for (size_t i = 0; i < header.faces; ++i) {
    const double count = reader.next(header.corner_count);
    if (!(count >= 0.0 && count <= 1.0e6))
      throw std::runtime_error("a face has an impossible number of vertices");
    polygon.resize(static_cast<size_t>(count));
    for (double& index : polygon) {
      index = reader.next(header.corner);
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
    NumberReader reader(in, header.is_ascii);
    TriangleMesh mesh;
    readVertices(header, reader, mesh);
    readFaces(header, reader, mesh);
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
