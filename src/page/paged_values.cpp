#include "page/paged_values.h"

namespace dtsdf {
namespace {

/// Each eviction frees 1 / kFreedShare of the memory more than necessary, so that the next values
/// fit without another eviction.
constexpr size_t kFreedShare = 8;

/// After a failure, the number of values that are added or read back before the disk is tried
/// again.
constexpr size_t kValuesBetweenTries = 64;

/// Memory of an entry and its node in a table, including the allocator's overhead.
constexpr size_t kEntryBytes = 240;

}  // namespace

PagedValues::PagedValues(const std::string& folder, uint64_t max_file_bytes, size_t max_bytes)
    : store_(folder, max_file_bytes, max_bytes / kFreedShare), max_bytes_(max_bytes) {}

std::shared_ptr<PagedValues::Entry> PagedValues::keep(std::shared_ptr<const void> value,
                                                      const ValueKind& kind) {
  auto entry = std::make_shared<Entry>(shared_from_this(), kind);
  const std::lock_guard<std::mutex> lock(mutex_);
  ++entries_;
  putInMemory(std::move(value), *entry);
  return entry;
}

std::shared_ptr<const void> PagedValues::get(Entry& entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (entry.value != nullptr) {
    order_.splice(order_.end(), order_, entry.place);
    return entry.value;
  }
  std::shared_ptr<const void> value = load(entry);
  if (value != nullptr) putInMemory(value, entry);
  return value;
}

std::shared_ptr<const void> PagedValues::take(Entry& entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::shared_ptr<const void> value = entry.value != nullptr ? entry.value : load(entry);
  if (value == nullptr && !entry.is_lost) store_.countLost();
  return value;
}

void PagedValues::forget(Entry& entry) {
  const std::lock_guard<std::mutex> lock(mutex_);
  removeFromMemory(entry);
  if (entry.record) store_.erase(*entry.record);
  --entries_;
}

void PagedValues::putInMemory(std::shared_ptr<const void> value, Entry& entry) {
  entry.place = order_.insert(order_.end(), &entry);
  entry.bytes = entry.kind.bytes(value.get());
  entry.value = std::move(value);
  bytes_ += entry.bytes;
  makeRoom();
}

void PagedValues::removeFromMemory(Entry& entry) {
  if (entry.value == nullptr) return;
  bytes_ -= entry.bytes;
  order_.erase(entry.place);
  entry.value.reset();
}

/// Reads a value from the disk. @return null if it is lost or cannot be read at the moment.
std::shared_ptr<const void> PagedValues::load(Entry& entry) {
  if (entry.is_lost) return nullptr;
  const auto start = std::chrono::steady_clock::now();
  std::vector<char> bytes;
  const RecordStore::Reading reading = store_.read(*entry.record, bytes);
  store_.noteWait(start);
  entry.is_lost = reading == RecordStore::Reading::kDamaged;
  return reading == RecordStore::Reading::kIntact
             ? entry.kind.read(
                   ByteReader(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()))
             : nullptr;
}

/// Moves the least recently used values to the disk. Values that are already on disk are not
/// written again.
void PagedValues::makeRoom() {
  const size_t share = max_bytes_ / kFreedShare;  // this much may wait to be written
  if (bytes_ <= max_bytes_ - share) return;
  if (calls_until_try_ > 0 && --calls_until_try_ > 0) return;
  const size_t aim = max_bytes_ - 2 * share;
  while (bytes_ > aim && !order_.empty()) {
    Entry& oldest = *order_.front();
    if (!writeOut(oldest)) {
      calls_until_try_ = kValuesBetweenTries;
      return;
    }
    removeFromMemory(oldest);
  }
}

/// Writes a value to the store, unless it is already there. @return whether it is there now.
bool PagedValues::writeOut(Entry& entry) {
  if (entry.record) return true;
  const auto out = std::make_shared<ByteWriter>();
  entry.kind.write(entry.value.get(), *out);
  const auto* const bytes = reinterpret_cast<const char*>(out->bytes.data());
  entry.record = store_.write({out, {{bytes, out->bytes.size()}}});
  return entry.record.has_value();
}

bool PagedValues::isFull() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return bytes_ > max_bytes_;
}

size_t PagedValues::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return bytes_ + store_.waitingBytes();
}

PagedValues::Stats PagedValues::stats() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Stats stats = store_.stats();
  stats.index_bytes += entries_ * kEntryBytes;
  return stats;
}

void PagedValues::resetCounts() {
  const std::lock_guard<std::mutex> lock(mutex_);
  store_.resetCounts();
}

}  // namespace dtsdf
