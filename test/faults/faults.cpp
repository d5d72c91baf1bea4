// A library that is preloaded into a program and makes its N-th call of one kind fail. DTSDF_FAULT
// is CALL:N, where CALL is allocate, read, write, rename, fsync or open. Counting starts at main()
// or, if DTSDF_FAULT_FROM is set, when a file whose path contains that value is opened. When the
// call fails, the file named by DTSDF_FAULT_MET is created.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
}

namespace {

std::atomic<long> calls_left{0};  ///< Counts down calls of the chosen kind; at 0, the call fails.
char chosen[16] = "";

bool fails(const char* call) {
  if (calls_left.load(std::memory_order_relaxed) <= 0) return false;
  if (std::strcmp(call, chosen) != 0) return false;
  if (calls_left.fetch_sub(1) != 1) return false;
  // Uses the system call, because open() below would count it.
  const char* const met = std::getenv("DTSDF_FAULT_MET");
  if (met != nullptr) {
    const long file = syscall(SYS_openat, AT_FDCWD, met, O_CREAT | O_WRONLY, 0600);
    if (file >= 0) syscall(SYS_close, file);
  }
  return true;
}

void arm() {
  const char* const fault = std::getenv("DTSDF_FAULT");
  const char* const colon = fault == nullptr ? nullptr : std::strchr(fault, ':');
  if (colon == nullptr || static_cast<size_t>(colon - fault) >= sizeof(chosen)) return;
  std::memcpy(chosen, fault, static_cast<size_t>(colon - fault));
  calls_left = std::atol(colon + 1);
}

using Main = int (*)(int, char**, char**);
Main program = nullptr;

int mainWithFault(int count, char** arguments, char** environment) {
  if (std::getenv("DTSDF_FAULT_FROM") == nullptr) arm();
  return program(count, arguments, environment);
}

void armAt(const char* path) {
  static std::atomic<bool> is_armed{false};
  const char* const from = std::getenv("DTSDF_FAULT_FROM");
  if (from != nullptr && std::strstr(path, from) != nullptr && !is_armed.exchange(true)) arm();
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

void* noMemory() {
  errno = ENOMEM;
  return nullptr;
}

int fault(int error_number) {
  errno = error_number;
  return -1;
}

}  // namespace

extern "C" {

int __libc_start_main(Main main, int count, char** arguments, void (*init)(), void (*fini)(),
                      void (*loader_fini)(), void* stack_end) {
  program = main;
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  return next<Start>("__libc_start_main")(mainWithFault, count, arguments, init, fini, loader_fini,
                                          stack_end);
}

void* malloc(size_t bytes) { return fails("allocate") ? noMemory() : __libc_malloc(bytes); }

void* calloc(size_t count, size_t bytes) {
  return fails("allocate") ? noMemory() : __libc_calloc(count, bytes);
}

void* realloc(void* memory, size_t bytes) {
  return fails("allocate") ? noMemory() : __libc_realloc(memory, bytes);
}

void* aligned_alloc(size_t alignment, size_t bytes) {
  return fails("allocate") ? noMemory() : __libc_memalign(alignment, bytes);
}

int posix_memalign(void** memory, size_t alignment, size_t bytes) {
  if (fails("allocate")) return ENOMEM;
  *memory = __libc_memalign(alignment, bytes);
  return *memory == nullptr ? ENOMEM : 0;
}

ssize_t read(int file, void* data, size_t bytes) {
  if (fails("read")) return fault(EIO);
  return syscall(SYS_read, file, data, bytes);
}

ssize_t pread(int file, void* data, size_t bytes, off_t offset) {
  if (fails("read")) return fault(EIO);
  return syscall(SYS_pread64, file, data, bytes, offset);
}

ssize_t write(int file, const void* data, size_t bytes) {
  if (fails("write")) return fault(ENOSPC);
  return syscall(SYS_write, file, data, bytes);
}

int fsync(int file) {
  if (fails("fsync")) return fault(EIO);
  return static_cast<int>(syscall(SYS_fsync, file));
}

int rename(const char* from, const char* to) {
  if (fails("rename")) return fault(EROFS);
  return static_cast<int>(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}

FILE* fopen(const char* path, const char* mode) {
  armAt(path);
  if (fails("open")) {
    errno = EMFILE;
    return nullptr;
  }
  return next<FILE* (*)(const char*, const char*)>("fopen")(path, mode);
}

FILE* fopen64(const char* path, const char* mode) { return fopen(path, mode); }

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int mode = va_arg(arguments, int);
  va_end(arguments);
  armAt(path);
  if (fails("open")) return fault(EMFILE);
  return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

}  // extern "C"
