/// What settings there are, and what numbers the rules have.
#pragma once

#include <string>

namespace dtsdf {

/// The text of --list-settings: every setting of the mapper and the node with its default, unit and
/// what it may be, by key.
std::string listSettings();

/// The text of --list-rules: every number with its default and range.
std::string listRules();

}  // namespace dtsdf
