/// Checksums of texts and of files as they grow: XXH64, as in map files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

struct XXH64_state_s;

namespace dtsdf {

/// Of bytes that come piece by piece.
class RunningHash {
 public:
  RunningHash();

  void add(const void* data, size_t bytes);
  uint64_t result() const;

 private:
  std::unique_ptr<XXH64_state_s, void (*)(XXH64_state_s*)> state_;
};

/// A checksum in 16 hexadecimal digits, as `map_tool info` shows one.
std::string hashDigits(uint64_t hash);

/// Of a text.
std::string hashText(const std::string& text);

}  // namespace dtsdf
