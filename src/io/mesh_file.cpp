#include "dtsdf_mapping/io/mesh_file.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <locale>
#include <sstream>
#include <stdexcept>

#include "io/atomic_file.h"
#include "io/glb.h"
#include "io/little_endian.h"
#include "io/ply.h"
#include "io/textured_mesh.h"
#include "kernels/core/vec.h"
#include "params/text.h"

namespace dtsdf {
namespace {

void writePly(const Mesh& mesh, MeshColour colour, AtomicFile& file) {
  file.write(plyHeader(mesh.vertices_m.size(), mesh.triangles.size(), isFarFromOrigin(mesh)));
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) writePlyVertex(mesh, i, colour, file);
  for (const auto& triangle : mesh.triangles) writePlyTriangle(triangle, file);
}

std::ostream& operator<<(std::ostream& out, const Vec3f& v) {
  return out << v.x << ' ' << v.y << ' ' << v.z;
}

template <class Flush>
void writeTexturedFaces(const TexturedMesh& textured, std::ostream& out, const Flush& flush_text) {
  for (const auto& places : textured.places) {
    for (const TexturePlace& at : places) out << "vt " << at[0] << ' ' << 1.0f - at[1] << '\n';
    flush_text();
  }
  size_t triangle = 0;
  for (size_t page = 0; page < textured.pages.size(); ++page) {
    out << "usemtl page_" << page << '\n';
    for (const size_t end = triangle + textured.page_triangles[page]; triangle < end; ++triangle) {
      out << 'f';
      for (size_t corner = 0; corner < 3; ++corner) {
        const uint32_t vertex = textured.mesh.triangles[triangle][corner] + 1;  // counted from 1
        out << ' ' << vertex << '/' << 3 * triangle + corner + 1 << '/' << vertex;
      }
      out << '\n';
      flush_text();
    }
  }
}

/// @param textured Null for a mesh without textures. @param material Name of the .mtl file.
void writeObj(const Mesh& mesh, MeshColour colour, AtomicFile& file,
              const TexturedMesh* textured = nullptr, const std::string& material = {}) {
  std::ostringstream out;
  out.imbue(std::locale::classic());  // the locale may have decimal commas
  constexpr int kDigits = std::numeric_limits<float>::max_digits10;
  out.precision(kDigits);
  const auto flush_text = [&] {
    file.write(out.str());
    out.str("");
  };
  out << "# metres, map frame\n";
  if (textured != nullptr) out << "mtllib " << material << '\n';
  for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    out << 'v';
    if (isFarFromOrigin(mesh)) {
      out.precision(std::numeric_limits<double>::max_digits10);
      for (const double x_m : positionInMap(mesh, i)) out << ' ' << x_m;
      out.precision(kDigits);
    } else {
      out << ' ' << mesh.vertices_m[i];
    }
    for (uint8_t channel : vertexColour(colour, mesh, i)) {
      out << ' ' << static_cast<int>(channel) / 255.0f;
    }
    out << '\n';
    flush_text();
  }
  for (const Vec3f& normal : mesh.normals) {
    out << "vn " << normal << '\n';
    flush_text();
  }
  if (textured != nullptr) writeTexturedFaces(*textured, out, flush_text);
  for (const auto& triangle : mesh.triangles) {
    if (textured != nullptr) break;
    out << 'f';
    for (uint32_t index : triangle) out << ' ' << index + 1 << "//" << index + 1;  // counted from 1
    out << '\n';
    flush_text();
  }
}

/// Unit normal of a triangle; zero, as .stl allows, if it has no area.
Vec3f triangleNormal(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f u = b - a, v = c - a;
  const Vec3f n{u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
  const float length = norm(n);
  return length > 0.0f ? (1.0f / length) * n : Vec3f{0.0f, 0.0f, 0.0f};
}

/// A position in the map frame, rounded to floats, as stored in .stl files.
Vec3f toFloats(const std::array<double, 3>& p_W) {
  return {static_cast<float>(p_W[0]), static_cast<float>(p_W[1]), static_cast<float>(p_W[2])};
}

void writeStl(const Mesh& mesh, AtomicFile& file) {
  std::string header = "binary STL, metres, map frame";  // must not begin with "solid"
  header.resize(80, ' ');
  file.write(header);
  put(file, static_cast<uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    const Vec3f& a = mesh.vertices_m[triangle[0]];
    const Vec3f& b = mesh.vertices_m[triangle[1]];
    const Vec3f& c = mesh.vertices_m[triangle[2]];
    put(file, triangleNormal(a, b, c));
    for (const uint32_t corner : triangle) put(file, toFloats(positionInMap(mesh, corner)));
    put(file, uint16_t{0});
  }
}

/// Checks that the format can hold the mesh.
void checkSize(const Mesh& mesh, const std::string& format, const std::string& path) {
  checkMeshSize(mesh.vertices_m.size(), mesh.triangles.size(), path);
  if (format == ".glb" &&
      maxGlbBytes(mesh.vertices_m.size(), mesh.triangles.size()) > kMaxGlbBytes) {
    throw std::runtime_error("cannot save '" + path +
                             "': the mesh does not fit into a .glb file (4 GiB); save it as .ply, "
                             "save a region, or simplify it");
  }
}

}  // namespace

/// Many programs read the indices of a .ply file as signed 32-bit numbers.
void checkMeshSize(uint64_t vertices, uint64_t triangles, const std::string& path) {
  constexpr uint64_t kMaxCount = std::numeric_limits<int32_t>::max();
  if (triangles == 0) {
    throw std::runtime_error("cannot save '" + path +
                             "': the mesh is empty; fuse frames with a visible surface first");
  }
  if (vertices > kMaxCount || triangles > kMaxCount) {
    throw std::runtime_error("cannot save '" + path +
                             "': the mesh has more than 2^31 - 1 vertices or triangles; "
                             "use larger voxels");
  }
}

const std::vector<std::string>& meshExtensions() {
  static const std::vector<std::string> extensions = {".ply", ".obj", ".stl", ".glb"};
  return extensions;
}

std::string meshFormatOf(const std::string& path) {
  const std::string extension = inLowerCase(std::filesystem::path(path).extension().string());
  const std::vector<std::string>& known = meshExtensions();
  return std::count(known.begin(), known.end(), extension) > 0 ? extension : "";
}

std::string lossInFormat(const Mesh& mesh, const std::string& path) {
  if (!isFarFromOrigin(mesh) || meshFormatOf(path) != ".stl") return "";
  return "positions in .stl files are floats, which are coarse this far from the map's origin; "
         ".ply stores doubles";
}

void saveMesh(const Mesh& mesh, MeshColour colour, const std::string& path) {
  const std::string format = meshFormatOf(path);
  if (format.empty()) {
    throw std::runtime_error("cannot save '" + path +
                             "': unknown format; give a name that ends in " + kMeshExtensions);
  }
  checkSize(mesh, format, path);
  AtomicFile file(path);
  if (format == ".ply") writePly(mesh, colour, file);
  if (format == ".obj") writeObj(mesh, colour, file);
  if (format == ".stl") writeStl(mesh, file);
  if (format == ".glb") writeGlb(mesh, colour, file);
  file.commit();
}

void saveTexturedMesh(const TexturedMesh& textured, const std::string& path) {
  const std::string format = meshFormatOf(path);
  if (format != ".obj" && format != ".glb") {
    throw std::runtime_error("cannot save '" + path +
                             "': a textured mesh can only be saved as .obj or .glb");
  }
  checkMeshSize(textured.mesh.vertices_m.size(), textured.mesh.triangles.size(), path);
  AtomicFile file(path);
  if (format == ".glb") {
    writeGlb(textured, file);
  } else {
    const std::filesystem::path base = std::filesystem::path(path).replace_extension();
    writeObj(textured.mesh, MeshColour::kAuto, file, &textured, base.filename().string() + ".mtl");
    std::string materials;
    for (size_t page = 0; page < textured.pages.size(); ++page) {
      const std::string number = std::to_string(page), png = base.string() + "_" + number + ".png";
      writeFileAtomically(png, textured.pages[page]);
      materials += "newmtl page_" + number + "\nKa 1 1 1\nKd 1 1 1\nillum 0\nmap_Kd " +
                   std::filesystem::path(png).filename().string() + "\n";
    }
    writeFileAtomically(base.string() + ".mtl", materials);
  }
  file.commit();
}

}  // namespace dtsdf
