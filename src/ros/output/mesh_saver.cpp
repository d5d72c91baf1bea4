#include "ros/output/mesh_saver.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "dtsdf_mapping/io/mesh_file.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

fs::path expandHome(const std::string& directory) {
  if (directory != "~" && directory.rfind("~/", 0) != 0) return directory;
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') {
    throw std::runtime_error("output_directory is '" + directory +
                             "', but HOME is not set; give an absolute path");
  }
  return fs::path(home) / directory.substr(std::min<size_t>(2, directory.size()));
}

bool liesIn(const fs::path& path, const fs::path& directory) {
  const auto [end, rest] =
      std::mismatch(directory.begin(), directory.end(), path.begin(), path.end());
  return end == directory.end() && rest != path.end();
}

}  // namespace

std::string resolveMeshPath(const std::string& output_directory, const std::string& file_name) {
  if (file_name.empty()) {
    throw std::runtime_error("file_name is empty; give a name such as 'mesh.ply'");
  }
  fs::path directory = fs::weakly_canonical(fs::absolute(expandHome(output_directory)));
  if (!directory.has_filename()) directory = directory.parent_path();  // "a/" -> "a"
  // An absolute file_name replaces the directory here, and has to lie in it like any other.
  const fs::path path = fs::weakly_canonical(directory / file_name);
  if (!liesIn(path, directory)) {
    throw std::runtime_error("'" + file_name + "' leads out of output_directory (" +
                             directory.string() + "); give a name under it");
  }
  if (!meshFormatOf(path.string())) {
    throw std::runtime_error("'" + file_name + "' has the extension of no mesh format; use .ply, "
                             ".obj or .stl");
  }
  return path.string();
}

}  // namespace dtsdf
