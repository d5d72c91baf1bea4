/// Threads for short loops in quick succession.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

namespace dtsdf {

/// Spins until `condition` holds, for at most about the time that it takes to wake a thread.
/// @return whether it holds.
template <class Condition>
bool spinUntil(const Condition& condition) {
  constexpr std::chrono::microseconds kSpinTime{30};
  constexpr int kChecksPerClock = 16;  // between two readings of the clock
  const auto end = std::chrono::steady_clock::now() + kSpinTime;
  do {
    for (int i = 0; i < kChecksPerClock; ++i) {
      if (condition()) return true;
#if defined(__x86_64__)
      __builtin_ia32_pause();
#elif defined(__aarch64__)
      asm volatile("yield");
#endif
    }
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

/// A thread of a team. The caller waits only for work that the thread has started.
class TeamMember {
 public:
  TeamMember() : thread_([this] { serve(); }) {}
  ~TeamMember() {
    set(State::kEnding);
    thread_.join();
  }

  /// Makes the thread call work(of, number), which must not throw. @pre release() has returned
  /// since the last call().
  void call(void (*work)(const void*, size_t), const void* of, size_t number) {
    work_ = work;
    of_ = of;
    number_ = number;
    set(State::kCalled);
  }

  /// Cancels work that has not started, and waits for work that has.
  void release() {
    State called = State::kCalled;
    if (state_.compare_exchange_strong(called, State::kIdle)) return;
    const auto is_idle = [this] { return state_ == State::kIdle; };
    if (!spinUntil(is_idle)) sleepUntil(is_idle);
  }

 private:
  enum class State { kIdle, kCalled, kWorking, kEnding };

  void serve() {
    const auto is_wanted = [this] { return state_ != State::kIdle; };
    for (;;) {
      if (!spinUntil(is_wanted)) sleepUntil(is_wanted);
      State called = State::kCalled;
      if (state_.compare_exchange_strong(called, State::kWorking)) {
        work_(of_, number_);
        set(State::kIdle);
      } else if (called == State::kEnding) {
        return;
      }
    }
  }

  /// Sets the state, and wakes the other side if it sleeps.
  void set(State state) {
    bool wakes;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      state_ = state;
      wakes = sleepers_ > 0;
    }
    if (wakes) changed_.notify_all();
  }

  template <class Condition>
  void sleepUntil(const Condition& condition) {
    std::unique_lock<std::mutex> lock(mutex_);
    ++sleepers_;
    changed_.wait(lock, condition);
    --sleepers_;
  }

  std::atomic<State> state_{State::kIdle};
  void (*work_)(const void*, size_t) = nullptr;
  const void* of_ = nullptr;
  size_t number_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  int sleepers_ = 0;    ///< Guarded by mutex_.
  std::thread thread_;  ///< Declared last, since the thread uses the other members.
};

/// Threads that help one thread with its loops. After a fork, the child process has no helpers.
class Team {
 public:
  Team() = default;
  ~Team() {
    if (isForked()) {
      for (auto& member : members_) static_cast<void>(member.release());  // no thread to join
    }
  }
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  /// The calling thread's team. It is destroyed before static objects, so their destructors must
  /// not run loops.
  static Team& own() {
    thread_local Team team;
    return team;
  }

  /// Calls body(number) on up to `threads` threads; the caller is number 0. When the caller's body
  /// returns, calls that have not started are cancelled, and run() waits for the calls in progress.
  /// The body must not throw. A nested run() uses the calling thread only.
  template <class Body>
  void run(size_t threads, const Body& body) {
    if (threads < 2 || isInBody()) return body(0);
    const size_t members = gather(threads - 1);
    const auto work = [](const void* of, size_t number) {
      isInBody() = true;
      (*static_cast<const Body*>(of))(number);
    };
    for (size_t i = 0; i < members; ++i) members_[i]->call(work, &body, i + 1);
    isInBody() = true;
    body(0);
    isInBody() = false;
    for (size_t i = 0; i < members; ++i) members_[i]->release();
  }

 private:
  /// Whether the calling thread is inside a body.
  static bool& isInBody() {
    thread_local bool is_helping = false;
    return is_helping;
  }

  bool isForked() const { return getpid() != pid_; }

  /// Starts members until there are `wanted`. @return their number; fewer if threads cannot be
  /// created, 0 after a fork.
  size_t gather(size_t wanted) {
    if (isForked()) return 0;
    try {
      while (members_.size() < wanted) members_.push_back(std::make_unique<TeamMember>());
    } catch (const std::system_error&) {  // no more threads
    } catch (const std::bad_alloc&) {     // no memory for a thread
    }
    return std::min(wanted, members_.size());
  }

  const pid_t pid_ = getpid();
  std::vector<std::unique_ptr<TeamMember>> members_;
};

}  // namespace dtsdf
