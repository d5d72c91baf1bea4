/// Makes external text safe to log and to publish: names in messages and files, and errors from
/// libraries. test/lint/check_text.py finds places that output external text unchanged.
#pragma once

#include <cstddef>
#include <exception>
#include <string>

namespace dtsdf {

constexpr size_t kLongestShownName = 200;

/// Makes an external name printable, so that it cannot move a terminal's cursor, forge a line of a
/// log or reverse the direction of text. Control characters (C0, C1, line separators, bidirectional
/// controls) and bytes that are not valid UTF-8 become \xHH. Text longer than `max_characters` is
/// cut and ends in "...".
std::string printable(const std::string& text, size_t max_characters = kLongestShownName);

/// Makes a whole message printable, including the external names in it.
std::string printableMessage(const std::string& text);

/// Whether printable() would change the characters of the text.
bool hasControlCharacter(const std::string& text);

/// The message of an exception, as one printable line.
std::string errorText(const std::exception& error);

}  // namespace dtsdf
