#include "io/file_hash.h"

#include <xxhash.h>

#include <cstdio>
#include <new>

namespace dtsdf {

struct RunningHash::State {
  State() : hash(XXH64_createState()) {
    if (hash == nullptr) throw std::bad_alloc();
    XXH64_reset(hash, 0);
  }
  ~State() { XXH64_freeState(hash); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  XXH64_state_t* const hash;
};

RunningHash::RunningHash() : state_(std::make_unique<State>()) {}
RunningHash::~RunningHash() = default;

void RunningHash::add(const void* data, size_t bytes) { XXH64_update(state_->hash, data, bytes); }

uint64_t RunningHash::result() const { return XXH64_digest(state_->hash); }

std::string hashDigits(uint64_t hash) {
  char digits[17];
  std::snprintf(digits, sizeof(digits), "%016llx", static_cast<unsigned long long>(hash));
  return digits;
}

std::string hashText(const std::string& text) {
  return hashDigits(XXH64(text.data(), text.size(), 0));
}

}  // namespace dtsdf
