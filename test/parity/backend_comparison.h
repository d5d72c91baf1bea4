/// Runs the same work on two mappers and compares everything they hand out, bit for bit.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "dtsdf_mapping/mesh.h"
#include "mapper/probed_mapper.h"

namespace dtsdf {

/// What is compared with the CPU on one thread.
enum class Candidate { kReference, kCpuTwoThreads, kCuda };

std::string toString(Candidate candidate);

/// Empty if the candidate can run here, else why not.
std::string reasonToSkip(Candidate candidate);

/// The reference and a candidate with the same settings, each fed the same.
class BackendPair {
 public:
  /// Also checks that both run where they should.
  BackendPair(const MapperParams& params, Candidate candidate, const Rules& rules = Rules());

  /// Compares the outcome, and the counts of the map too.
  void integrate(const DepthFrame& frame);
  /// Without a look at the map, which would make a GPU finish the frame.
  void integrateOnly(const DepthFrame& frame);
  /// As integrate().
  void paint(const ColourFrame& frame);
  /// Compares views of both maps, pixel by pixel.
  void compareViews(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C);
  /// As integrate(). @return what the candidate tells.
  ClearedRegion clearRegion(const Region& region);
  void updateMesh();
  void beginMeshUpdate();
  void finishMeshUpdate();
  void clear();

  /// Each takes the place of the other: both go on from the contents of the other's map, which are
  /// compared. Meshes begin anew.
  void swapContents();

  /// Compares all voxels and colours, the meshes put together from all updates, and spaces.
  void compareMaps();

  /// Compares what is known of space, and the distances once they are up to date.
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
/// Free cells and those with a surface are there, so that equal does not just mean empty.
void expectSpace(Mapper& mapper);

/// Whether a failure is that of a call that can lack memory. Tests have others fail as well, which
/// never do: what they leave is not looked at.
bool isAllocation(const std::string& message);

}  // namespace dtsdf
