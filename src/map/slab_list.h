/// A list that grows without moving what is there, and whose elements lie side by side.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace dtsdf {

template <class T>
class SlabList {
 public:
  size_t size() const { return size_; }
  T& operator[](size_t i) { return slabs_[i >> kSlabLog2][i & (kSlab - 1)]; }
  const T& operator[](size_t i) const { return slabs_[i >> kSlabLog2][i & (kSlab - 1)]; }

  /// Takes memory for so many, and touches it.
  void reserve(size_t size) {
    while (slabs_.size() * kSlab < size) slabs_.push_back(std::make_unique<T[]>(kSlab));
  }
  void push_back(const T& element) {
    reserve(size_ + 1);
    (*this)[size_++] = element;
  }
  void clear() {
    slabs_.clear();
    size_ = 0;
  }
  size_t memoryBytes() const { return slabs_.size() * kSlab * sizeof(T); }

 private:
  static constexpr size_t kSlabLog2 = 10, kSlab = size_t{1} << kSlabLog2;
  std::vector<std::unique_ptr<T[]>> slabs_;
  size_t size_ = 0;
};

}  // namespace dtsdf
