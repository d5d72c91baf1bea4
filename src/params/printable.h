/// Text from outside, as logs, messages and answers may show it: names in messages and files, and
/// what libraries say of them. test/lint/check_text.py finds where it goes out as it came.
#pragma once

#include <cstddef>
#include <exception>
#include <string>

namespace dtsdf {

constexpr size_t kLongestShownName = 200;

/// A name from outside that cannot move the cursor of a terminal, forge a line of a log, end a text
/// or turn its direction: bytes of control characters (C0, C1, line separators, bidirectional
/// controls) and those that are not UTF-8 become \xHH. Cut after so many characters, with "...".
std::string printable(const std::string& text, size_t most_characters = kLongestShownName);

/// Makes a whole message printable, with the names from outside that stand in it.
std::string printableMessage(const std::string& text);

/// Whether printable() would change it, but for its length.
bool hasControlCharacter(const std::string& text);

/// What an exception says, in one printable line.
std::string errorText(const std::exception& error);

}  // namespace dtsdf
