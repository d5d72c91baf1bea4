#include "params/printable.h"

#include <algorithm>
#include <boost/locale/utf.hpp>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <system_error>

namespace dtsdf {
namespace {

constexpr size_t kLongestMessage = 4000;

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
    const auto byte = static_cast<unsigned char>(text[at + i]);
    hex += "\\x";
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

}  // namespace

std::string printable(const std::string& text, size_t max_characters) {
  namespace utf = boost::locale::utf;
  std::string shown;
  size_t characters = 0;
  for (size_t at = 0; at < text.size(); ++characters) {
    if (characters == max_characters) return shown + "...";
    const auto begin = text.begin() + static_cast<std::ptrdiff_t>(at);
    auto end = begin;
    const utf::code_point code = utf::utf_traits<char>::decode(end, text.end());
    const bool is_valid = code != utf::illegal && code != utf::incomplete;
    // Each byte that is not valid UTF-8 counts as a character.
    const size_t bytes = is_valid ? static_cast<size_t>(end - begin) : 1;
    shown += is_valid && !isControl(code) ? text.substr(at, bytes) : inHex(text, at, bytes);
    at += bytes;
  }
  return shown;
}

std::string printableMessage(const std::string& text) { return printable(text, kLongestMessage); }

bool hasControlCharacter(const std::string& text) {
  return printable(text, std::numeric_limits<size_t>::max()) != text;
}

std::string errorText(const std::exception& error) {
  const auto* const file_error = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (file_error == nullptr) {
    std::string text = error.what();
    std::replace(text.begin(), text.end(), '\n',
                 ' ');  // messages from libraries may have several lines
    return printableMessage(text);
  }
  const std::string path = "'" + printable(file_error->path1().string()) + "'";
  if (file_error->code() == std::errc::too_many_symbolic_link_levels) {
    return path + " is a link that leads to itself; give the path of the actual file or folder";
  }
  return "cannot use " + path + ": " + file_error->code().message() +
         "; choose another file name or folder";
}

}  // namespace dtsdf
