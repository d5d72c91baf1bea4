/// Runs programs in a shell, as a user would.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "support/temporary_folder.h"

namespace dtsdf {

struct Outcome {
  int exit_code;  ///< -1 if a signal ended the command.
  std::string out, err;
};

/// Runs a shell command. Its output is also written to the files stdout and stderr in the folder.
inline Outcome runIn(const TemporaryFolder& folder, const std::string& command) {
  const std::string out = folder / "stdout", err = folder / "stderr";
  const int status = std::system((command + " > " + out + " 2> " + err + " < /dev/null").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, readBytes(out), readBytes(err)};
}

}  // namespace dtsdf
