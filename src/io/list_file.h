/// Text files with words in lines; lines that begin with # are comments.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

/// A line's words, and where it stands.
struct ListLine {
  std::vector<std::string> words;
  std::string place;  ///< "file:line"
};

/// The words of a text, between white space of any kind.
std::vector<std::string> splitWords(const std::string& text);

/// The lines of a file that hold something.
/// @throws std::runtime_error that names the file and `advice`, if it cannot be read.
std::vector<ListLine> readList(const std::string& path, const std::string& advice);

/// @throws std::runtime_error with the line's place.
[[noreturn]] void throwAt(const ListLine& line, const std::string& problem);

/// A word of a line as a finite number. @throws std::runtime_error with the line's place.
double numberAt(const ListLine& line, size_t index);

}  // namespace dtsdf
