#include "ros/common/worker_thread.h"

#include <sys/resource.h>

#include <utility>

namespace dtsdf {
namespace {

/// A tenth of a core that others of the process want as well; all of one that nobody wants. More
/// than Linux's greatest niceness counts as that.
constexpr int kLowNiceness = 10;

/// Linux keeps a niceness for each thread. Where it cannot be set, nothing is lost but the order.
void lowerPriorityOfThisThread() {
  setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + kLowNiceness);
}

}  // namespace

WorkerThread::WorkerThread(Step step, Priority priority)
    : step_(std::move(step)), thread_([this, priority] { loop(priority); }) {}

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
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    tasks_.clear();
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void WorkerThread::loop(Priority priority) {
  if (priority == Priority::kLow) lowerPriorityOfThisThread();
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

}  // namespace dtsdf
