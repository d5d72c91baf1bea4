#include "params/printable.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <system_error>

namespace dtsdf {
namespace {

constexpr size_t kLongestMessage = 4000;

/// One character of a text: how many bytes it has, and its code point. One byte that is not UTF-8
/// counts as a character without a code point.
struct Character {
  size_t bytes = 1;
  uint32_t code = 0;
  bool is_valid = false;
};

unsigned char byteAt(const std::string& text, size_t at) {
  return static_cast<unsigned char>(text[at]);
}

/// By the first byte; 0 for one that begins no character.
size_t lengthOf(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return 2;
  if (first >= 0xe0 && first < 0xf0) return 3;
  return first >= 0xf0 && first < 0xf5 ? 4 : 0;
}

Character characterAt(const std::string& text, size_t at) {
  const unsigned char first = byteAt(text, at);
  const size_t length = lengthOf(first);
  if (length == 0 || at + length > text.size()) return {};
  uint32_t code = length == 1 ? first : first & (0x7fu >> length);
  for (size_t i = 1; i < length; ++i) {
    const unsigned char next = byteAt(text, at + i);
    if ((next & 0xc0) != 0x80) return {};
    code = code << 6 | (next & 0x3f);
  }
  const bool is_too_long = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool is_surrogate = code >= 0xd800 && code < 0xe000;
  if (is_too_long || is_surrogate || code > 0x10ffff) return {};
  return {length, code, true};
}

bool isControl(uint32_t code) {
  const bool is_c0 = code < 0x20 || code == 0x7f, is_c1 = code >= 0x80 && code < 0xa0;
  const bool is_separator = code == 0x2028 || code == 0x2029;
  const bool turns_direction = code == 0x061c || code == 0x200e || code == 0x200f ||
                               (code >= 0x202a && code <= 0x202e) ||
                               (code >= 0x2066 && code <= 0x2069);
  return is_c0 || is_c1 || is_separator || turns_direction;
}

std::string inHex(const std::string& text, size_t at, size_t bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (size_t i = 0; i < bytes; ++i) {
    const unsigned char byte = byteAt(text, at + i);
    hex += "\\x";
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

}  // namespace

std::string printable(const std::string& text, size_t most_characters) {
  std::string shown;
  size_t characters = 0;
  for (size_t at = 0; at < text.size(); ++characters) {
    if (characters == most_characters) return shown + "...";
    const Character character = characterAt(text, at);
    shown += character.is_valid && !isControl(character.code) ? text.substr(at, character.bytes)
                                                              : inHex(text, at, character.bytes);
    at += character.bytes;
  }
  return shown;
}

std::string printableMessage(const std::string& text) { return printable(text, kLongestMessage); }

bool hasControlCharacter(const std::string& text) {
  return printable(text, std::numeric_limits<size_t>::max()) != text;
}

std::string errorText(const std::exception& error) {
  const auto* const of_files = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (of_files == nullptr) {
    std::string text = error.what();
    std::replace(text.begin(), text.end(), '\n', ' ');  // libraries write in several lines
    return printableMessage(text);
  }
  const std::string path = "'" + printable(of_files->path1().string()) + "'";
  if (of_files->code() == std::errc::too_many_symbolic_link_levels) {
    return path + " is a link to itself; give the path of the file or folder meant";
  }
  return "cannot use " + path + ": " + of_files->code().message() +
         "; choose another file name or folder";
}

}  // namespace dtsdf
