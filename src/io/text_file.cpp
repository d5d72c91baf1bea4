#include "io/text_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace dtsdf {

std::string readTextFile(const std::string& path, const std::string& advice) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  std::string problem;
  if (!std::filesystem::exists(status)) {
    problem = "there is no such file";
  } else if (std::filesystem::is_directory(status)) {
    problem = "it is a folder";
  } else {
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (file.is_open() && !file.bad()) return text;
    problem = "reading it failed";
  }
  throw std::runtime_error("cannot read '" + path + "': " + problem + "; " + advice);
}

}  // namespace dtsdf
