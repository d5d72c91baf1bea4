/// Composes and parses names, lists and numbers, independently of the locale.
#pragma once

#include <locale.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace dtsdf {

/// Whether a name ends with or equals `ending`.
inline bool endsWith(std::string_view name, std::string_view ending) {
  return name.size() >= ending.size() &&
         name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

/// Whether a name ends with `ending` and has something before it.
inline bool hasEnding(std::string_view name, std::string_view ending) {
  return name.size() > ending.size() && endsWith(name, ending);
}

/// Strips a frame's leading slash, which old tf used and tf2 does not support.
inline std::string stripLeadingSlash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

/// Converts ASCII letters to lower case.
inline std::string inLowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return 'A' <= c && c <= 'Z' ? static_cast<char>(c + 'a' - 'A') : c;
  });
  return text;
}

/// Joins words with a separator, and with `last` before the last word: "a, b and c".
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

/// vsnprintf() in the C locale.
__attribute__((format(printf, 3, 0))) inline int vsnprintfInC(char* line, size_t size,
                                                              const char* text, va_list values) {
  static const locale_t of_c = newlocale(LC_ALL_MASK, "C", nullptr);
  const locale_t before = uselocale(of_c);
  const int length = std::vsnprintf(line, size, text, values);
  uselocale(before);
  return length;
}

/// Formats like printf() in the C locale; the compiler checks the arguments.
// NOLINTNEXTLINE(cert-dcl50-cpp): the compiler does not check the arguments of a parameter pack
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

/// Formats a number with up to `digits` significant digits, without trailing zeros: 0.02, 1e-06,
/// 300.
inline std::string shortestText(double number, int digits = 6) {
  return formatted("%.*g", digits, number);
}

/// Parses text that consists of a number only. @return false if it contains anything else, or if
/// the number is too large.
template <class Number>
bool parseNumber(const std::string& text, Number& number) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  in >> std::noskipws >> number;
  return !in.fail() && in.peek() == std::istringstream::traits_type::eof();
}

}  // namespace dtsdf
