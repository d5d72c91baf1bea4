#include "ros/common/worker_thread.h"

#include <pthread.h>
#include <sys/resource.h>

namespace dtsdf {
namespace {

/// Callbacks that may be called before the step has its turn.
constexpr int kCallbacksPerStep = 50;
constexpr std::chrono::hours kWithoutStep{1};

}  // namespace

void WorkerThread::start(ThreadStep step, int threads) {
  step_ = std::move(step);
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { loop(); });
}

void WorkerThread::loop() {
  pthread_setname_np(pthread_self(), name_.c_str());
  // Linux keeps a niceness for each thread, and takes more than its greatest as that. Where it
  // cannot be set, only the order is lost.
  if (niceness_ > 0) setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + niceness_);
  std::chrono::milliseconds wait{0};
  while (!is_stopping_) {
    auto result = queue_.callOne(ros::WallDuration(std::chrono::duration<double>(wait).count()));
    for (int i = 1; i < kCallbacksPerStep && result == ros::CallbackQueue::Called; ++i) {
      result = queue_.callOne();
    }
    wait = step_ && !is_stopping_ ? step_() : kWithoutStep;
  }
}

void WorkerThread::stop() {
  is_stopping_ = true;
  queue_.disable();
  queue_.clear();  // who waits for a task need not wait for the one under way
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

}  // namespace dtsdf
