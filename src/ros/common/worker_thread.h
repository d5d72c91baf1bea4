/// The threads of the node: loops, and queues of callbacks.
#pragma once

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

namespace dtsdf {

/// The thread of a loop: it repeats a step, and runs tasks of other threads in between.
class WorkerThread {
 public:
  /// Does some work and says how long to wait before the next call, unless woken.
  using Step = std::function<std::chrono::milliseconds()>;

  /// A thread of low priority leaves the cores to the others where they are short.
  enum class Priority { kNormal, kLow };

  /// `step` must not throw.
  explicit WorkerThread(Step step, Priority priority = Priority::kNormal);
  ~WorkerThread() { stop(); }

  /// There may be work: calls the step without more delay.
  void wake();

  /// Runs `task` on the thread, between two steps, and hands its result or exception over.
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
  void loop(Priority priority);
  void runTasks();
  bool waitFor(std::chrono::milliseconds delay);

  Step step_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool woken_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

/// A callback queue with a thread of its own: what is called there may wait, and holds up nobody
/// but its caller.
class CallbackThread {
 public:
  /// More threads than one where a caller has to be noticed while another one waits.
  explicit CallbackThread(uint32_t threads = 1) : spinner_(threads, &queue_) {}

  /// A node handle whose callbacks are called on this thread.
  ros::NodeHandle serve(ros::NodeHandle nh) {
    nh.setCallbackQueue(&queue_);
    return nh;
  }

  void start() { spinner_.start(); }

  /// Waits for the callback under way; nothing is called any more.
  void stop() { spinner_.stop(); }

 private:
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_;
};

}  // namespace dtsdf
