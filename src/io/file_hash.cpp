#include "io/file_hash.h"

#include <xxhash.h>

#include <new>

#include "params/text.h"

namespace dtsdf {

RunningHash::RunningHash()
    : state_(XXH64_createState(), [](XXH64_state_s* state) { XXH64_freeState(state); }) {
  if (state_ == nullptr) throw std::bad_alloc();
  XXH64_reset(state_.get(), 0);
}

void RunningHash::add(const void* data, size_t bytes) { XXH64_update(state_.get(), data, bytes); }

uint64_t RunningHash::result() const { return XXH64_digest(state_.get()); }

std::string hashDigits(uint64_t hash) {
  return formatted("%016llx", static_cast<unsigned long long>(hash));
}

std::string hashText(const std::string& text) {
  return hashDigits(XXH64(text.data(), text.size(), 0));
}

}  // namespace dtsdf
