/// Texts that are put together and taken apart: names of files, topics, settings and coordinate
/// frames, lists of them, and numbers, which have a point whatever the locale of the host program.
#pragma once

#include <locale.h>

#include <algorithm>
#include <cctype>
#include <cstdarg>
#include <cstdio>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace dtsdf {

/// Also true of a name that is nothing but its ending.
inline bool endsWith(std::string_view name, std::string_view ending) {
  return name.size() >= ending.size() &&
         name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

/// What has something before its ending.
inline bool hasEnding(std::string_view name, std::string_view ending) {
  return name.size() > ending.size() && endsWith(name, ending);
}

/// A frame's name without the leading slash of old tf, which tf2 does not know.
inline std::string stripLeadingSlash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

/// Letters of ASCII in lower case; all else is left alone.
inline std::string inLowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// "a, b and c", with another separator and with `last` before the last one.
inline std::string joined(const std::vector<std::string>& words, const std::string& separator,
                          const std::string& last) {
  std::string text;
  for (size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? last : separator) + words[i];
  }
  return text;
}
inline std::string joined(const std::vector<std::string>& words,
                          const std::string& separator = ", ") {
  return joined(words, separator, separator);
}

/// vsnprintf() in the locale of C.
__attribute__((format(printf, 3, 0))) inline int vsnprintfInC(char* line, size_t size,
                                                              const char* text, va_list values) {
  static const locale_t of_c = newlocale(LC_ALL_MASK, "C", nullptr);
  const locale_t before = uselocale(of_c);
  const int length = std::vsnprintf(line, size, text, values);
  uselocale(before);
  return length;
}

/// As printf() has it; the compiler checks what is given by the text.
// NOLINTNEXTLINE(cert-dcl50-cpp): a parameter pack has no such check
__attribute__((format(printf, 1, 2))) inline std::string formatted(const char* text, ...) {
  char line[512];
  va_list values;
  va_start(values, text);
  const int length = vsnprintfInC(line, sizeof(line), text, values);
  va_end(values);
  if (length < static_cast<int>(sizeof(line))) return length < 0 ? std::string() : line;
  std::string whole(static_cast<size_t>(length) + 1, '\0');
  va_start(values, text);
  vsnprintfInC(whole.data(), whole.size(), text, values);
  va_end(values);
  whole.pop_back();
  return whole;
}

/// With as many digits as tell it apart from others of that many: 0.02, 1e-06, 300.
inline std::string shortestText(double number, int digits = 6) {
  return formatted("%.*g", digits, number);
}

/// The whole text as a number; false if anything is left over or it does not fit.
template <class Number>
bool parseNumber(const std::string& text, Number& number) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  in >> std::noskipws >> number;
  return !in.fail() && in.peek() == std::istringstream::traits_type::eof();
}

}  // namespace dtsdf
