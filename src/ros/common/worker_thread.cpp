#include "ros/common/worker_thread.h"

#include <pthread.h>
#include <sys/resource.h>

#include <utility>

namespace dtsdf {
namespace {

/// A tenth of a core that others of the process want as well; all of one that nobody wants. More
/// than Linux's greatest niceness counts as that.
constexpr int kLowNiceness = 10;
/// Callbacks that may be called before the step has its turn.
constexpr int kCallbacksPerStep = 50;
constexpr std::chrono::milliseconds kUntilLooking{100};

/// Linux keeps a niceness for each thread. Where it cannot be set, only the order is lost.
void enter(const std::string& name, ThreadPriority priority) {
  pthread_setname_np(pthread_self(), name.c_str());
  if (priority == ThreadPriority::kNormal) return;
  setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + kLowNiceness);
}

}  // namespace

void WorkerThread::start(ThreadStep step) {
  step_ = std::move(step);
  thread_ = std::thread([this] { loop(); });
}

void WorkerThread::wake() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    woken_ = true;
  }
  changed_.notify_one();
}

void WorkerThread::post(std::function<void()> task) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopping_) return;  // its future fails, as it is destroyed without being run
    tasks_.push_back(std::move(task));
  }
  changed_.notify_one();
}

void WorkerThread::stop() {
  std::deque<std::function<void()>> dropped;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    dropped.swap(tasks_);
  }
  changed_.notify_one();
  dropped.clear();  // who waits for them need not wait for the task under way
  if (thread_.joinable()) thread_.join();
}

void WorkerThread::loop() {
  enter(name_, priority_);
  do {
    runTasks();
  } while (waitFor(step_()));
}

void WorkerThread::runTasks() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!tasks_.empty()) {
    const std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    lock.lock();
  }
}

bool WorkerThread::waitFor(std::chrono::milliseconds delay) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, delay, [this] { return woken_ || stopping_ || !tasks_.empty(); });
  woken_ = false;
  return !stopping_;
}

void CallbackThread::start(int threads, ThreadStep step) {
  for (int i = 0; i < threads; ++i) {
    threads_.emplace_back([this, step] {
      enter(name_, priority_);
      loop(step);
    });
  }
}

void CallbackThread::loop(const ThreadStep& step) {
  std::chrono::milliseconds wait{0};
  while (!stopping_) {
    queue_.callOne(ros::WallDuration(std::chrono::duration<double>(wait).count()));
    for (int i = 1; step && i < kCallbacksPerStep && !stopping_; ++i) {
      if (queue_.callOne() != ros::CallbackQueue::Called) break;
    }
    wait = step && !stopping_ ? std::min(step(), kUntilLooking) : kUntilLooking;
  }
}

void CallbackThread::stop() {
  stopping_ = true;
  queue_.disable();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  queue_.clear();
}

}  // namespace dtsdf
