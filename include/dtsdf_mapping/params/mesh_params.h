/// Settings for the mesh.
#pragma once

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf {

/// What the colour of a vertex shows.
enum class MeshColour {
  kAuto,    ///< kImage if the map was painted, else kNormal.
  kImage,   ///< Colour from images; like kPlain where the surface is not painted.
  kNormal,  ///< Direction of the surface normal as red, green and blue.
  kHeight,  ///< z in the map frame, as a repeating rainbow.
  kPlain,   ///< The same light grey everywhere.
};

/// How a mesh is made and coloured.
struct MeshParams {
  MeshColour colour = MeshColour::kAuto;  ///< Colour of the vertices, in RViz and in saved files.
  int min_support = 2;  ///< Frames that must support a surface; fewer if the map has fewer frames.
  int refine = 0;       ///< 1: split each triangle into four on the curved surface.
};

/// Visits each member with its key and its rule.
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
