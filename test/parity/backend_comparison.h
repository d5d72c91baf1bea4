/// Runs the same work on two mappers and compares all results bit for bit.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "dtsdf_mapping/mesh.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// The backends that are compared with the CPU on one thread.
enum class Candidate { kReference, kCpuTwoThreads, kCuda };

std::string toString(Candidate candidate);

/// Why the candidate cannot run here; empty if it can.
std::string reasonToSkip(Candidate candidate);

/// The reference and a candidate with the same settings and the same input.
class BackendPair {
 public:
  /// Also checks that each mapper uses the requested backend.
  BackendPair(const MapperParams& params, Candidate candidate, const Rules& rules = Rules());

  /// Compares the results, and the statistics of both maps.
  void integrate(const DepthFrame& frame);
  /// Compares only the results, since reading the map would make a GPU finish the frame.
  void integrateUnchecked(const DepthFrame& frame);
  /// Compares as integrate() does.
  void paint(const ColourFrame& frame);
  /// Compares views of both maps, pixel by pixel.
  void compareViews(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C);
  /// Compares as integrate() does. @return the candidate's result.
  ClearedRegion clearRegion(const Region& region);
  void updateMesh();
  void beginMeshUpdate();
  void finishMeshUpdate();
  void clear();

  /// Swaps the contents of both mappers after comparing them; each continues from the other's map.
  /// Meshes start from scratch.
  void swapContents();

  /// Compares all voxels and colours, the meshes assembled from all updates, and the free-space
  /// grids, if any.
  void compareMaps();

  /// Updates the distances, and compares the free-space cells and their distances.
  void compareSpaces();

  ProbedMapper& reference() { return *reference_; }
  ProbedMapper& candidate() { return *candidate_; }

 private:
  void compareStats();

  const MapperParams reference_params_, candidate_params_;
  const Rules rules_;
  std::unique_ptr<ProbedMapper> reference_, candidate_;
  MeshStore reference_mesh_, candidate_mesh_;
};

void expectEqualUpdates(const MeshUpdate& expected, const MeshUpdate& actual);
void expectEqualMeshes(const Mesh& expected, const Mesh& actual);
void expectEqualMaps(ProbedMapper& expected, ProbedMapper& actual);
void expectEqualSpaces(Space& expected, Space& actual);
void expectEqualContents(const MapContents& expected, const MapContents& actual);

size_t countCells(Mapper& mapper, CellState state);
/// Checks that free cells and surface cells exist, so that two empty grids cannot pass as equal.
void expectSpace(Mapper& mapper);

/// Whether an error message is about a call that allocates memory. Tests also make other calls
/// return an out-of-memory error, which cannot happen in practice; the state after these errors is
/// not compared.
bool isAllocation(const std::string& message);

}  // namespace dtsdf
