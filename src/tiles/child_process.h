/// `tiles fuse` as a process of its own: what ends it does not end who waits for it.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace dtsdf {

struct ChildRequest {
  std::vector<std::string> arguments;  ///< Behind the program's name; the program is this one.
  std::string log_path;                ///< What it says is appended there.
  std::string visible_gpu;             ///< CUDA_VISIBLE_DEVICES; empty: as it is.
};

class ChildProcess {
 public:
  /// @throws std::runtime_error if it cannot be started.
  explicit ChildProcess(const ChildRequest& request);
  /// Ends the child, if it has not ended yet.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// How it has ended, or nothing if it has not: "" for well, or "exit code 1", "signal 9".
  std::optional<std::string> ended();

 private:
  pid_t process_;
};

/// The numbers of the GPUs that this process may use: of CUDA_VISIBLE_DEVICES, or else of /dev.
std::vector<std::string> visibleGpus();

/// Has the kernel end this process as soon as the one with this id, which has started it, ends.
void endWithProcess(pid_t parent);

}  // namespace dtsdf
