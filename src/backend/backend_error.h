/// What a backend throws.
#pragma once

#include <stdexcept>
#include <string>

namespace dtsdf {

/// A backend failed. Where it lacks memory the map is as it was, and smaller work may succeed.
class BackendError : public std::runtime_error {
 public:
  BackendError(bool lacks_memory, const std::string& text)
      : std::runtime_error(text), lacks_memory_(lacks_memory) {}
  bool lacksMemory() const { return lacks_memory_; }

 private:
  bool lacks_memory_;
};

}  // namespace dtsdf
