/// A background thread that runs one task at a time.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace dtsdf {

/// Not thread-safe. The destructor waits for the task and ignores its error.
class Helper {
 public:
  ~Helper() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  /// Waits for the previous task and starts `task`. @throws the error of the previous task, or
  /// std::system_error if no thread can be created. In either case, `task` is not started.
  void start(std::function<void()> task) {
    wait();
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      task_ = std::move(task);
      is_busy_ = true;
    }
    changed_.notify_all();
  }

  /// Waits until the task is done, if any. @throws its error.
  void wait() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !is_busy_; });
    if (error_ != nullptr) std::rethrow_exception(std::exchange(error_, nullptr));
  }

  /// Waits until the task is done, if any, and ignores its error.
  void finish() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !is_busy_; });
    error_ = nullptr;
  }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return ends_ || task_ != nullptr; });
      if (task_ == nullptr) return;
      const std::function<void()> task = std::exchange(task_, nullptr);
      lock.unlock();
      std::exception_ptr error;
      try {
        task();
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      error_ = error;
      is_busy_ = false;
      changed_.notify_all();
    }
  }

  std::mutex mutex_;  ///< Guards the members below, except thread_.
  std::condition_variable changed_;
  std::function<void()> task_;
  std::exception_ptr error_;
  bool is_busy_ = false, ends_ = false;
  std::thread thread_;
};

}  // namespace dtsdf
