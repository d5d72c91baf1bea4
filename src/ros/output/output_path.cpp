#include "ros/output/output_path.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "params/printable.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

bool liesIn(const fs::path& path, const fs::path& directory) {
  const auto [end, rest] =
      std::mismatch(directory.begin(), directory.end(), path.begin(), path.end());
  return end == directory.end() && rest != path.end();
}

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// ".ply, .obj, .stl or .glb"
std::string inWords(const std::vector<std::string>& extensions) {
  std::string text;
  for (size_t i = 0; i < extensions.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == extensions.size() ? " or " : ", ") + extensions[i];
  }
  return text;
}

}  // namespace

std::string expandHome(const std::string& path, const std::string& name) {
  if (path != "~" && path.rfind("~/", 0) != 0) return path;
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') {
    throw std::runtime_error(name + " is '" + path +
                             "', but HOME is not set; give an absolute path");
  }
  return (fs::path(home) / path.substr(std::min<size_t>(2, path.size()))).string();
}

std::string resolveOutputPath(const std::string& output_directory, const std::string& file_name,
                              const std::vector<std::string>& extensions) {
  if (file_name.empty()) {
    throw std::runtime_error("file_name is empty; give a name such as 'name" + extensions.front() +
                             "'");
  }
  if (hasControlCharacter(file_name)) {
    throw std::runtime_error("'" + printable(file_name) + "' has a control character in it; give "
                             "a plain name such as 'name" + extensions.front() + "'");
  }
  fs::path directory =
      fs::weakly_canonical(fs::absolute(expandHome(output_directory, "output_directory")));
  if (!directory.has_filename()) directory = directory.parent_path();  // "a/" -> "a"
  // An absolute file_name replaces the directory here, and has to lie in it like any other.
  const fs::path path = fs::weakly_canonical(directory / file_name);
  if (!liesIn(path, directory)) {
    throw std::runtime_error("'" + file_name + "' leads out of output_directory (" +
                             directory.string() + "); give a name under it");
  }
  const std::string extension = lowerCase(path.extension().string());
  if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
    throw std::runtime_error("'" + file_name + "' has the wrong extension; use " +
                             inWords(extensions));
  }
  return path.string();
}

}  // namespace dtsdf
