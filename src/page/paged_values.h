/// Values that never change, such as sectors of the free-space grid. Recently used values are kept
/// in memory, all others in a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "map/byte_stream.h"
#include "page/record_store.h"

namespace dtsdf {

/// How values of a type are written as records and read back.
struct ValueKind {
  size_t (*bytes)(const void* value);  ///< Memory of a value, in bytes.
  void (*write)(const void* value, ByteWriter& out);
  std::shared_ptr<const void> (*read)(ByteReader in);
};

template <class T>
size_t bytesOf(const T& value) {
  return value.bytes();
}
template <class Io, class T>
void visitRecord(Io& io, T& value) {
  value.visitRecord(io);
}

/// The ValueKind of a type for which bytesOf() and visitRecord() are defined. visitRecord() both
/// writes and reads the members.
template <class T>
const ValueKind& kindOf() {
  static const ValueKind kind{
      [](const void* value) { return bytesOf(*static_cast<const T*>(value)); },
      [](const void* value, ByteWriter& out) {
        visitRecord(out, *const_cast<T*>(static_cast<const T*>(value)));  // only read here
      },
      [](ByteReader in) -> std::shared_ptr<const void> {
        auto value = std::make_shared<T>();
        visitRecord(in, *value);
        return value;
      }};
  return kind;
}

/// The memory and the file that values share. Thread-safe.
class PagedValues : public std::enable_shared_from_this<PagedValues> {
 public:
  using Stats = PageStats;  ///< Counters for values since the start or resetCounts().

  /// A value in memory, on disk or both.
  struct Entry {
    Entry(std::shared_ptr<PagedValues> its_pages, const ValueKind& its_kind)
        : pages(std::move(its_pages)), kind(its_kind) {}
    ~Entry() { pages->forget(*this); }
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;

    const std::shared_ptr<PagedValues> pages;
    const ValueKind& kind;
    std::shared_ptr<const void> value;  ///< Null if it is only on disk.
    std::list<Entry*>::iterator place;  ///< Its position in order_, if the value is in memory.
    size_t bytes = 0;                   ///< Size of the value, if it is in memory.
    std::optional<StoredRecord> record;
    bool is_lost = false;
  };

  /// @param max_file_bytes Maximum size of the file.
  /// @param max_bytes Maximum memory of all values, in bytes.
  /// @throws std::runtime_error if the folder cannot be written.
  PagedValues(const std::string& folder, uint64_t max_file_bytes, size_t max_bytes);

  std::shared_ptr<Entry> keep(std::shared_ptr<const void> value, const ValueKind& kind);

  /// Returns the value, after loading it into memory if necessary; null if it is lost or cannot be
  /// read at the moment.
  std::shared_ptr<const void> get(Entry& entry);

  /// Like get(), for an entry that is about to be destroyed. A value that cannot be read is lost.
  std::shared_ptr<const void> take(Entry& entry);

  /// Whether the disk responded to the last read.
  bool diskResponds() const { return store_.diskResponds(); }

  /// Whether memory is over its limit because the disk refuses values.
  bool isFull() const;

  size_t bytes() const;  ///< Memory of the values, including those waiting to be written.
  Stats stats() const;
  void resetCounts();

 private:
  void forget(Entry& entry);
  void putInMemory(std::shared_ptr<const void> value, Entry& entry);
  void removeFromMemory(Entry& entry);
  std::shared_ptr<const void> load(Entry& entry);
  void makeRoom();
  bool writeOut(Entry& entry);

  mutable std::mutex mutex_;  ///< Guards all members, and the entries.
  RecordStore store_;
  const size_t max_bytes_;
  std::list<Entry*> order_;  ///< Values in memory, least recently used first.
  size_t bytes_ = 0;         ///< Memory of the values in order_.
  size_t entries_ = 0;
  size_t calls_until_try_ = 0;  ///< After a failure: calls until the disk is tried again.
};

using SharedPagedValues = std::shared_ptr<PagedValues>;

/// A value, in memory or on disk. Copies share the value.
template <class T>
class Paged {
 public:
  Paged() = default;
  /// @param pages If null, the value stays in memory.
  Paged(std::shared_ptr<const T> value, const SharedPagedValues& pages) {
    if (pages == nullptr) {
      value_ = std::move(value);
    } else {
      entry_ = pages->keep(std::move(value), kindOf<T>());
    }
  }

  /// The value; null if it is lost or cannot be read at the moment.
  std::shared_ptr<const T> get() const {
    if (entry_ == nullptr) return value_;
    return std::static_pointer_cast<const T>(entry_->pages->get(*entry_));
  }

  /// Takes the value out, so that it can be changed. @pre There are no copies of this object.
  std::shared_ptr<T> take() {
    std::shared_ptr<const T> value = std::move(value_);
    if (entry_ != nullptr) {
      value = std::static_pointer_cast<const T>(entry_->pages->take(*entry_));
      entry_.reset();
    }
    return std::const_pointer_cast<T>(std::move(value));
  }

 private:
  std::shared_ptr<const T> value_;  ///< Used if values are not paged.
  std::shared_ptr<PagedValues::Entry> entry_;
};

}  // namespace dtsdf
