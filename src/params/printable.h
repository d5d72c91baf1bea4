/// Names that others chose, as logs and messages may show them.
#pragma once

#include <string>

namespace dtsdf {

/// The text with its control characters as \xHH: what is in a name must not move the cursor of the
/// terminal that a log is read in, nor end what is told by a NUL. UTF-8 stays as it is.
inline std::string printable(const std::string& text) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string shown;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f) {
      shown += c;
      continue;
    }
    shown += "\\x";
    shown += kDigits[byte >> 4];
    shown += kDigits[byte & 15];
  }
  return shown;
}

/// Whether printable() would change it.
inline bool hasControlCharacter(const std::string& text) { return printable(text) != text; }

}  // namespace dtsdf
