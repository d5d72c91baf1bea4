/// Small text files, their words and the numbers in them.
#pragma once

#include <string>
#include <vector>

#include "params/text.h"

namespace dtsdf {

/// Before a file is opened whose reader may wait: pipes and devices are refused, and files of over
/// 1 GiB. @throws std::runtime_error that names it and `advice`.
void requireRegularFile(const std::string& path, const std::string& advice);

/// The content of a file, as requireRegularFile() has it.
/// @throws std::runtime_error that names it and `advice`.
std::string readTextFile(const std::string& path, const std::string& advice);

// Text files with words in lines; lines that begin with # are comments.

/// A line's words, and where it stands.
struct ListLine {
  std::vector<std::string> words;
  std::string place;  ///< "file:line"
};

/// The words of a text, between white space of any kind.
std::vector<std::string> splitWords(const std::string& text);

/// The lines of a file that hold something. @throws as readTextFile()
std::vector<ListLine> readList(const std::string& path, const std::string& advice);

/// @throws std::runtime_error with the line's place.
[[noreturn]] void throwAt(const ListLine& line, const std::string& problem);

/// A word of a line as a finite number. @throws std::runtime_error with the line's place.
double numberAt(const ListLine& line, size_t index);

}  // namespace dtsdf
