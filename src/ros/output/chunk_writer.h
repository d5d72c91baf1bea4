/// The two forms in which chunks of the mesh are sent: markers for every viewer, blocks for little
/// bandwidth.
#pragma once

#include <ros/advertise_options.h>
#include <ros/serialized_message.h>
#include <ros/time.h>

#include <memory>
#include <string>

#include "meshing/packed_chunk.h"

namespace dtsdf {

/// Puts messages together, chunk by chunk.
class ChunkWriter {
 public:
  virtual ~ChunkWriter() = default;

  /// Topic and type.
  virtual ros::AdvertiseOptions advertiseOptions() const = 0;

  /// Starts a message, whose chunks lie on a lattice of this step in metres. One that begins anew
  /// has its receiver forget all chunks first.
  virtual void begin(bool anew, double step_m, const ros::Time& stamp) = 0;

  /// Adds a chunk; one without triangles is removed by its receiver. `id` is the chunk's for ever.
  virtual void add(PackedChunk chunk, int id) = 0;

  /// Of the message so far, about.
  virtual size_t bytes() const = 0;

  virtual ros::SerializedMessage finish() = 0;
};

/// `mesh`: a TRIANGLE_LIST for each chunk, with a colour per vertex.
std::unique_ptr<ChunkWriter> makeMarkerWriter(const std::string& map_frame, MeshColour colour);

/// `mesh_blocks`: chunks as they are packed.
std::unique_ptr<ChunkWriter> makeBlockWriter(const std::string& map_frame);

}  // namespace dtsdf
