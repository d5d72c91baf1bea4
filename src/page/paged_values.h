/// Values that never change, such as the sectors of a table: those that were used last are in
/// memory, the others lie in a file.
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

/// How a value becomes a record, and comes back from one.
struct ValueKind {
  size_t (*bytes)(const void* value);  ///< What it takes in memory.
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

/// The kind of a type with bytesOf() and visitRecord(), which lists its members once for both.
template <class T>
const ValueKind& kindOf() {
  static const ValueKind kind{
      [](const void* value) { return bytesOf(*static_cast<const T*>(value)); },
      [](const void* value, ByteWriter& out) {
        visitRecord(out, *const_cast<T*>(static_cast<const T*>(value)));  // which only reads it
      },
      [](ByteReader in) -> std::shared_ptr<const void> {
        auto value = std::make_shared<T>();
        visitRecord(in, *value);
        return value;
      }};
  return kind;
}

/// Memory and file that values share. Any thread may use it.
class PagedValues : public std::enable_shared_from_this<PagedValues> {
 public:
  using Stats = PageStats;  ///< Counts for values since the start or resetCounts().

  /// A value, wherever it is.
  struct Entry {
    explicit Entry(std::shared_ptr<PagedValues> its_pages) : pages(std::move(its_pages)) {}
    ~Entry() { pages->forget(*this); }
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;

    const std::shared_ptr<PagedValues> pages;
    const ValueKind* kind = nullptr;
    std::shared_ptr<const void> value;  ///< Null: it is on disk alone.
    std::list<Entry*>::iterator place;  ///< In the order of use, with a value.
    size_t bytes = 0;                   ///< What it takes in memory, with a value.
    std::optional<StoredRecord> record;
    bool is_lost = false;
  };

  /// @param max_bytes Limit of the file.
  /// @param most_bytes What stays in memory.
  /// @throws std::runtime_error where the folder cannot be written.
  PagedValues(const std::string& folder, uint64_t max_bytes, size_t most_bytes);

  std::shared_ptr<Entry> keep(std::shared_ptr<const void> value, const ValueKind& kind);

  /// The value, which comes to memory. @return null: it is lost, or cannot be read now.
  std::shared_ptr<const void> get(Entry& entry);

  /// Like get(), and the entry has it no longer: if it cannot be read, it is lost.
  std::shared_ptr<const void> take(Entry& entry);

  /// Whether the disk gave something when it was asked last.
  bool diskGives() const { return store_.gives(); }

  /// Whether more is in memory than should, as the disk takes none.
  bool isFull() const;

  size_t bytes() const;  ///< What the values take in memory.
  Stats stats() const;
  void resetCounts();

 private:
  void forget(Entry& entry);
  void leaveMemory(Entry& entry);
  void leaveDisk(Entry& entry);
  std::shared_ptr<const void> load(Entry& entry);
  void makeRoom();
  bool writeOut(Entry& entry);

  mutable std::mutex mutex_;  ///< Guards all, entries included.
  RecordStore store_;
  const size_t most_bytes_;
  std::list<Entry*> order_;  ///< Values in memory, those that were used longest ago first.
  size_t bytes_ = 0;         ///< What these take in memory.
  size_t entries_ = 0;
  size_t calls_until_try_ = 0;  ///< After a failure the disk is left alone at first.
};

using SharedPagedValues = std::shared_ptr<PagedValues>;

/// A value, in memory or on disk. Copies of it are the same value.
template <class T>
class Paged {
 public:
  Paged() = default;
  /// @param pages Null: it stays in memory.
  Paged(std::shared_ptr<const T> value, const SharedPagedValues& pages) {
    if (pages == nullptr) {
      value_ = std::move(value);
    } else {
      entry_ = pages->keep(std::move(value), kindOf<T>());
    }
  }

  /// @return null: it is lost, or cannot be read now.
  std::shared_ptr<const T> get() const {
    if (entry_ == nullptr) return value_;
    return std::static_pointer_cast<const T>(entry_->pages->get(*entry_));
  }

  /// The value, to be changed: this has none any more. @pre There are no copies of it.
  std::shared_ptr<T> take() {
    std::shared_ptr<const T> value = std::move(value_);
    if (entry_ != nullptr) {
      value = std::static_pointer_cast<const T>(entry_->pages->take(*entry_));
      entry_.reset();
    }
    return std::const_pointer_cast<T>(std::move(value));
  }

 private:
  std::shared_ptr<const T> value_;  ///< Without pages.
  std::shared_ptr<PagedValues::Entry> entry_;
};

}  // namespace dtsdf
