#include "ros/output/output_path.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <system_error>

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

/// The path with its links resolved, as far as it exists.
fs::path resolved(const fs::path& path, const std::string& advice) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(path), error);
  // Of a name that is too long only the whole path says so.
  if (!error) static_cast<void>(fs::status(canonical, error));
  if (!error || error == std::errc::no_such_file_or_directory ||
      error == std::errc::not_a_directory || error == std::errc::permission_denied) {
    return canonical;
  }
  throw std::runtime_error("'" + printable(path.string()) + "' cannot be used: " + error.message() +
                           "; " + advice);
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
    throw std::runtime_error("'" + printable(file_name) + "' contains a control character; " +
                             "give a plain name such as 'name" + extensions.front() + "'");
  }
  fs::path directory = resolved(expandHome(output_directory, "output_directory"),
                                "set output_directory to another folder");
  if (!directory.has_filename()) directory = directory.parent_path();  // "a/" -> "a"
  // An absolute file_name replaces the directory here, and has to lie in it like any other.
  const fs::path path = resolved(directory / file_name, "give another name");
  if (!liesIn(path, directory)) {
    throw std::runtime_error("'" + printable(file_name) + "' is outside output_directory (" +
                             printable(directory.string()) + "); give a name under it");
  }
  const std::string extension = lowerCase(path.extension().string());
  if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
    throw std::runtime_error("'" + printable(file_name) + "' has the wrong extension; use " +
                             inWords(extensions));
  }
  return path.string();
}

}  // namespace dtsdf
