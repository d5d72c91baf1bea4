/// The threads of the node.
#pragma once

#include <pthread.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <sys/resource.h>
#include <boost/make_shared.hpp>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace dtsdf {

/// Niceness of background threads: they get a tenth of a contended core, and all of an idle one.
constexpr int kLowNiceness = 10;

/// Does some work and returns how long to wait before the next call.
using ThreadStep = std::function<std::chrono::milliseconds()>;

/// A callback queue with its own threads, which run ROS callbacks and tasks from other threads, and
/// repeat a step in between.
class WorkerThread {
 public:
  /// @param name Name of the threads, as shown by ps and top; at most 15 bytes.
  explicit WorkerThread(std::string name, int niceness = 0)
      : name_(std::move(name)), niceness_(niceness) {}
  ~WorkerThread() { stop(); }

  /// A node handle whose callbacks are called on these threads.
  ros::NodeHandle serve(ros::NodeHandle nh) {
    nh.setCallbackQueue(&queue_);
    return nh;
  }

  /// Starts serving the queue and repeating the step, which must not throw. Use several threads if
  /// tasks may block.
  void start(ThreadStep step, int threads = 1) {
    step_ = std::move(step);
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { loop(); });
  }

  /// Calls the step as soon as possible.
  void wake() {
    run([] {});
  }

  /// Runs `task` on a thread between two steps. The future receives the task's result or exception.
  template <class Task>
  auto run(Task task) -> std::future<decltype(task())> {
    using Result = decltype(task());
    struct Call : ros::CallbackInterface {
      explicit Call(Task task) : packaged(std::move(task)) {}
      CallResult call() override {
        packaged();
        return Success;
      }
      std::packaged_task<Result()> packaged;
    };
    const auto call = boost::make_shared<Call>(std::move(task));
    auto result = call->packaged.get_future();
    queue_.addCallback(call);  // after stop(), this destroys the call, so its future fails
    return result;
  }

  /// Stops the threads, after waiting for the calls in progress. Queued tasks fail with
  /// std::future_error; callbacks are dropped.
  void stop() {
    is_stopping_ = true;
    queue_.disable();
    queue_.clear();  // queued tasks fail without waiting for the running one
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  void loop() {
    pthread_setname_np(pthread_self(), name_.c_str());
    // On Linux, niceness is per thread. It is only a hint, so a failure to set it is ignored.
    if (niceness_ > 0) setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + niceness_);
    constexpr int kCallbacksPerStep = 50;  // many, so that callbacks do not each wait for a step
    constexpr std::chrono::hours kIdleWait{1};
    std::chrono::milliseconds wait{0};
    while (!is_stopping_) {
      auto result = queue_.callOne(ros::WallDuration(std::chrono::duration<double>(wait).count()));
      for (int i = 1; i < kCallbacksPerStep && result == ros::CallbackQueue::Called; ++i) {
        result = queue_.callOne();
      }
      wait = step_ && !is_stopping_ ? step_() : kIdleWait;
    }
  }

  const std::string name_;
  const int niceness_;
  ThreadStep step_;
  ros::CallbackQueue queue_;
  std::atomic<bool> is_stopping_{false};
  std::vector<std::thread> threads_;
};

}  // namespace dtsdf
