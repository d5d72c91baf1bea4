/// A plain triangle mesh, and functions for reading, writing, scaling and sampling it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

/// Positions are in metres, triangles counter-clockwise as viewed from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<std::array<uint8_t, 3>> colours;  ///< RGB per vertex, or empty.
};

/// Reads a .ply file (ASCII or binary little-endian) with vertices and faces. Polygons are split
/// into fans. Vertex properties other than positions and colours are ignored.
/// @throws std::runtime_error that names the file and the problem.
TriangleMesh readPly(const std::string& path);

/// Writes a binary little-endian .ply, with colours if the mesh has any.
/// @throws std::runtime_error if the file cannot be written.
void writePly(const std::string& path, const TriangleMesh& mesh);

/// Moves the centre of the bounding box to the origin, and scales the mesh so that the longest side
/// of the box has the given length.
void centreAndScale(TriangleMesh& mesh, float longest_side_m);

/// Area of each triangle, in m^2.
std::vector<double> triangleAreas(const TriangleMesh& mesh);

/// Points sampled uniformly by area, and the triangle in which each point lies.
struct SurfaceSamples {
  std::vector<Eigen::Vector3f> points;
  std::vector<uint32_t> triangles;
};

/// Samples a mesh. The same seed gives the same samples on every machine. Returns no samples if the
/// mesh has no area.
SurfaceSamples sampleSurface(const TriangleMesh& mesh, size_t count, uint64_t seed);

}  // namespace dtsdf
