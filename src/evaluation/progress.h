/// A progress line on the terminal; silent where standard error is no terminal.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace dtsdf {

/// To be called with the number of items done; ends its line at `total`.
std::function<void(size_t)> terminalProgress(const std::string& what, size_t total);

}  // namespace dtsdf
