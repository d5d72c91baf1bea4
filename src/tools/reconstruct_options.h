/// The command line of `reconstruct`.
#pragma once

#include <string>
#include <vector>

#include "tools/run_options.h"

namespace dtsdf {

struct ReconstructOptions : RunOptions {
  size_t mesh_every = 0;          ///< Frames between mesh updates; 0 to extract only at the end.
  std::string mesh_path;          ///< Empty if no mesh is saved.
  double simplify_error_m = 0.0;  ///< Allowed error of the saved mesh; 0 saves all triangles.
  std::string load_map_path;      ///< Empty to begin with an empty map.
  bool allow_gaps = false;        ///< Exit with 0 even if most images are unusable.
  std::string poses_frame;        ///< Frame of --poses for a journal; empty for its map frame.
  std::string trajectory_path;    ///< Empty if the poses are not saved.
  std::string only;               ///< The box to build, as text; empty for the whole map.
  std::string save_map_path;      ///< Empty if the map is not saved.
};

/// @throws UsageError that names the option, TextRequest for --help.
ReconstructOptions parseReconstructOptions(const std::vector<std::string>& arguments);

}  // namespace dtsdf
