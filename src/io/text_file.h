/// Reads files into memory, and splits text files into words and numbers.
#pragma once

#include <string>
#include <vector>

#include "params/text.h"

namespace dtsdf {

/// Rejects missing files, folders, pipes and devices (which may block a reader), and files larger
/// than 1 GiB.
/// @throws std::runtime_error with the path and `advice`.
void requireRegularFile(const std::string& path, const std::string& advice);

/// The content of a file that requireRegularFile() accepts, without a byte order mark at its start.
/// @throws std::runtime_error with the path and `advice`.
std::string readTextFile(const std::string& path, const std::string& advice);

// Lists are text files that contain words on each line; lines that begin with # are comments.

/// A line, split into words.
struct ListLine {
  std::vector<std::string> words;
  std::string place;  ///< "file:line"
};

/// Splits a text at white space.
std::vector<std::string> splitWords(const std::string& text);

/// The lines of a file that are neither empty nor comments. @throws like readTextFile()
std::vector<ListLine> readList(const std::string& path, const std::string& advice);

/// @throws std::runtime_error with the line's place.
[[noreturn]] void throwAt(const ListLine& line, const std::string& problem);

/// Parses a word of a line as a finite number. @throws std::runtime_error with the line's place.
double numberAt(const ListLine& line, size_t index);

}  // namespace dtsdf
