/// Records stored in columns, for vector instructions.
#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

namespace dtsdf {

/// Up to kMax records of 32-bit words, with one array per word, so that compilers can vectorise
/// loops over records. Fold expressions are used because loops over words in set() and get() would
/// prevent this.
template <class Record, int kMax>
class Columns {
  static_assert(std::is_trivially_copyable<Record>::value, "");
  static constexpr size_t kWord = sizeof(uint32_t), kWords = sizeof(Record) / kWord;
  static_assert(sizeof(Record) == kWords * kWord, "");
  using AllWords = std::make_index_sequence<kWords>;

 public:
  void set(int i, const Record& record) { set(i, record, AllWords()); }
  Record operator[](int i) const { return get(i, AllWords()); }

 private:
  template <size_t... kWordNumber>
  void set(int i, const Record& record, std::index_sequence<kWordNumber...>) {
    const char* bytes = reinterpret_cast<const char*>(&record);
    (std::memcpy(&words_[kWordNumber][i], bytes + kWordNumber * kWord, kWord), ...);
  }
  template <size_t... kWordNumber>
  Record get(int i, std::index_sequence<kWordNumber...>) const {
    Record record;
    char* bytes = reinterpret_cast<char*>(&record);
    (std::memcpy(bytes + kWordNumber * kWord, &words_[kWordNumber][i], kWord), ...);
    return record;
  }

  uint32_t words_[kWords][kMax];
};

}  // namespace dtsdf
