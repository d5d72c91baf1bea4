/// Small text files and the numbers in them, independent of the host program's locale.
#pragma once

#include <locale>
#include <sstream>
#include <string>

namespace dtsdf {

/// Before a file is opened whose reader may wait: pipes and devices are refused, and files of over
/// 1 GiB. @throws std::runtime_error that names it and `advice`.
void requireRegularFile(const std::string& path, const std::string& advice);

/// The content of a file, as requireRegularFile() has it.
/// @throws std::runtime_error that names it and `advice`.
std::string readTextFile(const std::string& path, const std::string& advice);

/// The whole text as a number; false if anything is left over or it does not fit.
template <class Number>
bool parseNumber(const std::string& text, Number& number) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  in >> std::noskipws >> number;
  return !in.fail() && in.peek() == std::istringstream::traits_type::eof();
}

}  // namespace dtsdf
