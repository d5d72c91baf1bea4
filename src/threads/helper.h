/// A thread that does one thing at a time beside whoever asks for it.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace dtsdf {

/// One thread at a time uses it.
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

  /// Begins with a task, once the one before is done. @throws what that one did.
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

  /// Waits until the task is done, if there is one. @throws what it did.
  void wait() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !is_busy_; });
    if (error_ != nullptr) std::rethrow_exception(std::exchange(error_, nullptr));
  }

  /// Waits until the task is done, if there is one, and forgets what it did.
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

  std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable changed_;
  std::function<void()> task_;
  std::exception_ptr error_;
  bool is_busy_ = false, ends_ = false;
  std::thread thread_;
};

}  // namespace dtsdf
