/// The exception that backends throw.
#pragma once

#include <stdexcept>
#include <string>

namespace dtsdf {

/// A backend failed. If it ran out of memory, the map is unchanged, and a smaller frame may still
/// succeed.
class BackendError : public std::runtime_error {
 public:
  BackendError(bool lacks_memory, const std::string& text)
      : std::runtime_error(text), is_out_of_memory_(lacks_memory) {}
  bool isOutOfMemory() const { return is_out_of_memory_; }

 private:
  bool is_out_of_memory_;
};

}  // namespace dtsdf
