/// Chunks of the mesh as they are sent in messages, and back.
#pragma once

#include <dtsdf_mapping/MeshBlock.h>

#include "meshing/packed_chunk.h"

namespace dtsdf {

dtsdf_mapping::MeshBlock toMessage(PackedChunk chunk);

/// Whoever reads the chunk may rely on the lengths of its parts and on its indices.
/// @throws std::runtime_error that says what is wrong with the message.
PackedChunk toChunk(dtsdf_mapping::MeshBlock block);

}  // namespace dtsdf
