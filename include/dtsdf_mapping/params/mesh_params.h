/// Settings for the mesh.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// How vertices are coloured.
enum class MeshColour {
  kAuto,    ///< kImage if the map was painted, otherwise kNormal.
  kImage,   ///< Colour from images; kPlain where the surface is not painted.
  kNormal,  ///< Direction of the surface normal as red, green and blue.
  kHeight,  ///< z in the map frame, shown as a repeating rainbow.
  kPlain,   ///< Light grey.
};

/// How a mesh is extracted and coloured.
struct MeshParams {
  MeshColour colour = MeshColour::kAuto;  ///< Colour of the vertices, in RViz and in saved files.
  /// Number of frames that must support a surface; fewer if fewer were fused.
  int min_support = 2;
  int refine = 0;  ///< 1: split each triangle into four that follow the curved surface.
};

/// Visits each member with its key and the rule for its value.
/// @relates MeshParams
template <class Visitor>
void visitParams(MeshParams& p, Visitor& visit) {
  visit("mesh/colour", p.colour,
        EnumNames<MeshColour>{{"auto", MeshColour::kAuto},
                              {"image", MeshColour::kImage},
                              {"normal", MeshColour::kNormal},
                              {"height", MeshColour::kHeight},
                              {"plain", MeshColour::kPlain}});
  visit("mesh/min_support", p.min_support, Range{1, 10});
  visit("mesh/refine", p.refine, Range{0, 1});
}

}  // namespace dtsdf
