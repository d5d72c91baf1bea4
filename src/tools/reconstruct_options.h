/// The command line of `reconstruct`.
#pragma once

#include <string>
#include <vector>

#include "tools/run_options.h"

namespace dtsdf {

struct ReconstructOptions : RunOptions {
  size_t mesh_every = 0;          ///< Frames between mesh updates; 0: only at the end.
  std::string mesh_path;          ///< Empty: no mesh is saved.
  double simplify_error_m = 0.0;  ///< Allowed error of the saved mesh; 0: all triangles.
  std::string load_map_path;      ///< Empty: the run begins with an empty map.
  bool allow_gaps = false;        ///< Succeed with fewer than half of the images.
  std::string poses_frame;        ///< Frame of --poses for a journal; empty: its map frame.
  std::string trajectory_path;    ///< Empty: the poses are not saved.
  std::string only;               ///< A box, as text; empty: the whole map.
  std::string save_map_path;      ///< Empty: the map is not saved.
};

/// @throws UsageError that names the option, TextRequest for --help.
ReconstructOptions parseReconstructOptions(const std::vector<std::string>& arguments);

}  // namespace dtsdf
