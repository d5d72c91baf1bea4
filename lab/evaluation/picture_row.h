/// Pictures side by side in one file, each below its title.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

struct TitledPicture {
  std::string title, path;
};

/// Writes a .png of the pictures from left to right on white. @throws std::runtime_error if there
/// is none, if one of them is no picture, or if the .png cannot be written.
void joinPictures(const std::string& path, const std::vector<TitledPicture>& pictures);

}  // namespace dtsdf
