/// Room for what is written anew for each frame.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>

namespace dtsdf {

/// Unlike a vector it neither copies nor clears anything where it grows: its pages come to the
/// threads that write to them.
template <class T>
class ScratchArray {
 public:
  /// What it held is lost.
  void makeRoom(size_t count) {
    if (count <= size_) return;
    const size_t size = std::max(count, size_ + size_ / 2);
    *this = ScratchArray();  // both would be more than it takes
    elements_.reset(new T[size]);
    size_ = size;
  }
  T& operator[](size_t i) { return elements_[i]; }
  const T& operator[](size_t i) const { return elements_[i]; }
  const T* begin() const { return elements_.get(); }
  size_t bytes() const { return size_ * sizeof(T); }

 private:
  std::unique_ptr<T[]> elements_;
  size_t size_ = 0;
};

}  // namespace dtsdf
