/// The frame log on a thread of its own: who fuses waits neither for codes nor for the disk.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "log/frame_log.h"

namespace dtsdf {

/// What is known of the log.
struct LogReport {
  uint64_t bytes = 0;
  uint64_t waiting_bytes = 0;           ///< Of images that wait for the disk.
  std::optional<double> first_stamp_s;  ///< From then on the map can be corrected; none: not yet.
  uint64_t lost = 0;                    ///< Images and calls that could not be logged.
  std::string problem;                  ///< Why, the last time; empty while the log is whole.
};

/// Thread safe. Never throws at whoever logs: what cannot be logged is counted, and the log begins
/// anew with the map as it is then.
class LogQueue {
 public:
  struct Options {
    FrameLog::Options log;
    size_t max_bytes = 256u << 20;         ///< Of images that wait.
    std::chrono::seconds retry_after{10};  ///< After a failure of the disk.
  };

  /// @throws std::runtime_error as FrameLog does.
  explicit LogQueue(Options options);
  /// What waits is written.
  ~LogQueue();

  /// A stretch with the map as it is.
  void begin(LogBegin begin, WriteMap write_map);

  // What happened to the map. `pixels` keeps the image alive.
  void add(const DepthFrame& frame, double stamp_s, uint32_t camera,
           std::shared_ptr<const void> pixels);
  void add(const ColourFrame& frame, double stamp_s, uint32_t camera,
           std::shared_ptr<const void> pixels);
  void add(const Region& region);
  void addLevel(const Eigen::Isometry3d& T_W_M);
  void add(const LogCorrection& correction);

  /// Whether a new stretch should begin, with the contents of the map.
  bool wantsMap() const;

  /// Where the next record comes, once all before it are written; nothing if some of them could not
  /// be.
  std::future<std::optional<LogMark>> mark();

  LogReport report() const;

 private:
  struct Entry {
    std::function<void(FrameLog&)> write;
    std::optional<std::promise<std::optional<LogMark>>> mark = std::nullopt;
    size_t bytes = 0;
    bool begins = false;
  };

  void push(Entry entry);
  template <class Frame>
  void addImage(const Frame& frame, double stamp_s, uint32_t camera,
                std::shared_ptr<const void> pixels);
  void loop();
  void take(Entry& entry);
  void noteState();
  void noteFailure(const std::string& problem);
  void noteGap(const std::string& problem);  ///< @pre mutex_ is held.

  const Options options_;
  FrameLog log_;              ///< The thread's, once it runs.
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable changed_;
  std::deque<Entry> entries_;
  size_t waiting_bytes_ = 0;
  bool stopping_ = false;
  bool has_gap_ = true;  ///< What is pushed now has no place in the log before the next begin().
  bool log_wants_map_ = false;
  size_t begins_waiting_ = 0;
  std::optional<std::chrono::steady_clock::time_point> failed_at_;
  LogReport report_;
  std::thread thread_;
};

}  // namespace dtsdf
