#include "tiles/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <system_error>

extern char** environ;

namespace dtsdf {
namespace {

constexpr char kThisProgram[] = "/proc/self/exe";
constexpr char kVisibleGpus[] = "CUDA_VISIBLE_DEVICES";

/// Pointers to texts that live as long as these.
std::vector<char*> pointersTo(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  pointers.reserve(texts.size() + 1);
  for (std::string& text : texts) pointers.push_back(&text[0]);
  pointers.push_back(nullptr);
  return pointers;
}

std::vector<std::string> environmentWith(const std::string& visible_gpu) {
  const std::string setting = std::string(kVisibleGpus) + "=";
  std::vector<std::string> environment;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    if (visible_gpu.empty() || text.rfind(setting, 0) != 0) environment.push_back(text);
  }
  if (!visible_gpu.empty()) environment.push_back(setting + visible_gpu);
  return environment;
}

/// What the child's standard streams are.
class Streams {
 public:
  explicit Streams(const std::string& log_path) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, log_path.c_str(),
                                     O_WRONLY | O_CREAT | O_APPEND, 0666);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
  }
  ~Streams() { posix_spawn_file_actions_destroy(&actions_); }
  Streams(const Streams&) = delete;
  Streams& operator=(const Streams&) = delete;

  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_;
};

std::string describe(int status) {
  if (WIFSIGNALED(status)) return "signal " + std::to_string(WTERMSIG(status));
  const int code = WEXITSTATUS(status);
  return code == 0 ? "" : "exit code " + std::to_string(code);
}

}  // namespace

ChildProcess::ChildProcess(const ChildRequest& request) {
  std::vector<std::string> arguments = {kThisProgram};
  arguments.insert(arguments.end(), request.arguments.begin(), request.arguments.end());
  std::vector<std::string> environment = environmentWith(request.visible_gpu);
  const Streams streams(request.log_path);
  const int error = posix_spawn(&process_, kThisProgram, streams.get(), nullptr,
                                pointersTo(arguments).data(), pointersTo(environment).data());
  if (error != 0) {
    throw std::runtime_error("cannot start a process that writes to '" + request.log_path +
                             "': " + std::generic_category().message(error));
  }
}

ChildProcess::~ChildProcess() {
  if (process_ <= 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

std::optional<std::string> ChildProcess::ended() {
  int status = 0;
  const pid_t got = waitpid(process_, &status, WNOHANG);
  if (got == 0) return std::nullopt;
  process_ = -1;
  return got < 0 ? "unknown error" : describe(status);
}

std::vector<std::string> visibleGpus() {
  std::vector<std::string> gpus;
  if (const char* const visible = std::getenv(kVisibleGpus)) {
    std::istringstream list(visible);
    for (std::string gpu; std::getline(list, gpu, ',');) gpus.push_back(gpu);
    return gpus;
  }
  while (std::filesystem::exists("/dev/nvidia" + std::to_string(gpus.size()))) {
    gpus.push_back(std::to_string(gpus.size()));
  }
  return gpus;
}

void endWithProcess(pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) throw std::runtime_error("the parent process ended");
}

}  // namespace dtsdf
