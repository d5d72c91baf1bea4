/// Threads and GPUs do not survive fork(): what a process made works in that process only.
#pragma once

#include <unistd.h>

#include <stdexcept>
#include <string>

namespace dtsdf::python {

/// Notes the process that it is made in.
class OneProcess {
 public:
  /// @throws std::runtime_error in a process that was forked from one with such objects.
  explicit OneProcess(const std::string& what) : what_(what), pid_(getpid()) {
    static const pid_t first = getpid();  // of the first that was made; a fork inherits it
    if (pid_ != first) {
      throw std::runtime_error("a " + what +
                               " cannot be made in a process that was forked after "
                               "dtsdf_mapping was used: start processes by "
                               "multiprocessing.get_context(\"spawn\")");
    }
  }
  bool isHere() const { return pid_ == getpid(); }
  /// @throws std::runtime_error in another process.
  void check() const {
    if (isHere()) return;
    throw std::runtime_error("this " + what_ +
                             " was made in another process, before fork(): make "
                             "one in this process, started by "
                             "multiprocessing.get_context(\"spawn\")");
  }

 private:
  std::string what_;
  pid_t pid_;
};

}  // namespace dtsdf::python
