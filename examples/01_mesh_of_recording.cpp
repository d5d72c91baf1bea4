// Reconstructs a mesh from a recording: 01_mesh_of_recording RECORDING MESH.ply
#include <dtsdf_mapping/io/mesh_file.h>
#include <dtsdf_mapping/io/recording.h>
#include <dtsdf_mapping/mapper.h>
#include <dtsdf_mapping/mesh.h>

#include <iostream>

int main(int argc, char** argv) try {
  if (argc != 3) throw std::invalid_argument("usage: 01_mesh_of_recording RECORDING MESH.ply");
  dtsdf::RecordingOptions options;
  options.path = argv[1];
  const auto recording = dtsdf::openRecording(options);

  dtsdf::MapperParams params;  // default settings; uses CUDA if available
  const auto mapper = dtsdf::makeMapper(params);
  while (const auto frame = recording->next()) {
    const dtsdf::IntegrationResult result = mapper->integrate(frame->depth);
    if (result.status != dtsdf::FrameStatus::kFused) std::cerr << result.message << "\n";
  }
  dtsdf::MeshStore meshes(params.map.voxel_size_m);
  meshes.apply(mapper->updateMesh());
  dtsdf::saveMesh(meshes.assemble(), dtsdf::MeshColour::kAuto, argv[2]);
  std::cout << argv[2] << ": " << meshes.triangleCount() << " triangles\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
