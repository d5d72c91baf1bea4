/// The threads of the node: loops, and queues of callbacks.
#pragma once

#include <ros/callback_queue.h>
#include <ros/node_handle.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace dtsdf {

/// A thread of low priority leaves the cores to the others where they are short.
enum class ThreadPriority { kNormal, kLow };

/// Does some work and returns how long to wait before the next call.
using ThreadStep = std::function<std::chrono::milliseconds()>;

/// The thread of a loop: it repeats a step, and runs tasks of other threads in between.
class WorkerThread {
 public:
  /// `name` is what the system shows, of at most 15 bytes.
  explicit WorkerThread(std::string name, ThreadPriority priority = ThreadPriority::kNormal)
      : name_(std::move(name)), priority_(priority) {}
  ~WorkerThread() { stop(); }

  /// Repeats the step from now on, which must not throw. Tasks that were posted before are run.
  void start(ThreadStep step);

  /// There may be work: calls the step without more delay.
  void wake();

  /// Runs `task` on the thread, between two steps, and gives its result or exception.
  template <class Task>
  auto run(Task task) -> std::future<decltype(task())> {
    auto packaged = std::make_shared<std::packaged_task<decltype(task())()>>(std::move(task));
    auto result = packaged->get_future();
    post([packaged] { (*packaged)(); });
    return result;
  }

  /// Ends the thread. Tasks that were not run fail with std::future_error.
  void stop();

 private:
  void post(std::function<void()> task);
  void loop();
  void runTasks();
  bool waitFor(std::chrono::milliseconds delay);

  const std::string name_;
  const ThreadPriority priority_;
  ThreadStep step_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool woken_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

/// A callback queue with threads of its own: what is called there may wait, and delays nobody but
/// its caller.
class CallbackThread {
 public:
  explicit CallbackThread(std::string name, ThreadPriority priority = ThreadPriority::kNormal)
      : name_(std::move(name)), priority_(priority) {}
  ~CallbackThread() { stop(); }

  /// A node handle whose callbacks are called on these threads.
  ros::NodeHandle serve(ros::NodeHandle nh) {
    nh.setCallbackQueue(&queue_);
    return nh;
  }

  ros::CallbackQueue& queue() { return queue_; }

  /// Calls callbacks from now on, and between some of them the step, if there is one.
  void start(int threads, ThreadStep step = nullptr);

  /// Waits for the callbacks under way; those that wait are dropped.
  void stop();

 private:
  void loop(const ThreadStep& step);

  const std::string name_;
  const ThreadPriority priority_;
  ros::CallbackQueue queue_;
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> threads_;
};

}  // namespace dtsdf
