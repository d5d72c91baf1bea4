/// A plain triangle mesh, which the evaluation programs read, scale and write.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

/// Positions in metres; triangles counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<std::array<uint8_t, 3>> colours;  ///< RGB per vertex, or empty.
};

/// Reads a .ply file, ASCII or binary little-endian, of vertices and faces. Splits polygons into
/// fans and ignores vertex properties other than positions and colours.
/// @throws std::runtime_error with the file and the problem.
TriangleMesh readPly(const std::string& path);

/// Writes a binary little-endian .ply, with colours if the mesh has any.
/// @throws std::runtime_error if the file cannot be written.
void writePly(const std::string& path, const TriangleMesh& mesh);

/// Moves the centre of the bounding box to the origin, and scales the longest side of the box to
/// this length.
void centreAndScale(TriangleMesh& mesh, float longest_side_m);

/// Area of each triangle in m^2.
std::vector<double> triangleAreas(const TriangleMesh& mesh);

/// Points drawn uniformly by area, and the triangle in which each point lies.
struct SurfaceSamples {
  std::vector<Eigen::Vector3f> points;
  std::vector<uint32_t> triangles;
};

/// Samples a mesh. The same seed gives the same samples on every machine. Returns no samples if the
/// mesh has no area.
SurfaceSamples sampleSurface(const TriangleMesh& mesh, size_t count, uint64_t seed);

}  // namespace dtsdf
