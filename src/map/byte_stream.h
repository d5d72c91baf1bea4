/// Serialises values to bytes and back, for map files and for pages on disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace dtsdf {

using Bytes = std::vector<uint8_t>;

/// Appends numbers, strings and structures. A structure needs a function fields(io, value) that
/// passes each of its members to `io`. ByteReader uses the same function.
class ByteWriter {
 public:
  template <class Value>
  ByteWriter& put(const Value& value) {
    if constexpr (std::is_arithmetic_v<Value> || std::is_enum_v<Value>) {
      const auto* const first = reinterpret_cast<const uint8_t*>(&value);
      bytes.insert(bytes.end(), first, first + sizeof(value));
    } else {
      fields(*this, const_cast<Value&>(value));  // fields() only reads the value here
    }
    return *this;
  }
  /// Appends the length as a uint32, then the characters.
  ByteWriter& put(const std::string& text) {
    return put(static_cast<uint32_t>(text.size())).putText(text);
  }
  ByteWriter& putText(const std::string& text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
    return *this;
  }
  template <class... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }
  /// Appends all values.
  template <class T>
  void rest(const std::vector<T>& values) {
    for (const T& value : values) put(value);
  }
  /// Appends `count` values exactly as they are laid out in memory.
  template <class T>
  void array(const T* values, size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto* const first = reinterpret_cast<const uint8_t*>(values);
    bytes.insert(bytes.end(), first, first + count * sizeof(T));
  }
  template <class T>
  void array(const std::vector<T>& values, size_t count) {
    array(values.data(), count);
  }

  Bytes bytes;
};

/// Reads what ByteWriter wrote. @throws std::out_of_range if too few bytes are left.
class ByteReader {
 public:
  ByteReader(const uint8_t* data, size_t size) : next_(data), end_(data + size) {}
  explicit ByteReader(const Bytes& bytes) : ByteReader(bytes.data(), bytes.size()) {}

  template <class... Values>
  void operator()(Values&... values) {
    (takeTo(values), ...);
  }
  template <class Value>
  Value take() {
    Value value;
    takeTo(value);
    return value;
  }
  /// Reads values up to the end.
  template <class T>
  void rest(std::vector<T>& values) {
    values.reserve(left() / sizeof(T));
    while (left() > 0) takeTo(values.emplace_back());
  }
  template <class T>
  void array(T* values, size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    const uint8_t* const from = takeBytes(count * sizeof(T));
    if (count > 0) std::memcpy(values, from, count * sizeof(T));
  }
  template <class T>
  void array(std::vector<T>& values, size_t count) {
    values.resize(count);
    array(values.data(), count);
  }
  /// Skips `count` bytes. @return a pointer to the first of them.
  const uint8_t* takeBytes(size_t count) {
    if (left() < count) throw std::out_of_range("a record is too short");
    next_ += count;
    return next_ - count;
  }
  size_t left() const { return static_cast<size_t>(end_ - next_); }

 private:
  template <class Value>
  void takeTo(Value& value) {
    if constexpr (std::is_same_v<Value, bool>) {
      value = take<uint8_t>() != 0;
    } else if constexpr (std::is_arithmetic_v<Value> || std::is_enum_v<Value>) {
      std::memcpy(&value, takeBytes(sizeof(value)), sizeof(value));
    } else {
      fields(*this, value);
    }
  }
  void takeTo(std::string& text) {
    const auto size = take<uint32_t>();
    const uint8_t* const first = takeBytes(size);
    text.assign(first, first + size);
  }

  const uint8_t *next_, *end_;
};

}  // namespace dtsdf
