/// Runs programs and their commands, and turns errors into one line of text and an exit code.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace dtsdf {

/// Runs a program. Prints an exception as one line on standard error, or the text of a TextRequest
/// on standard output; failing to write this text is an error, too.
/// @return exit code: 0, 1 for an error, 2 for a wrong command line or setting.
int runProgram(const std::string& name, int argc, const char* const* argv,
               const std::function<void(const std::vector<std::string>&)>& program);

/// Runs a program with the options that `read` returns for its arguments.
template <class Read, class Run>
int runProgram(const std::string& name, int argc, const char* const* argv, const Read& read,
               const Run& run) {
  return runProgram(name, argc, argv, [&](const auto& arguments) { run(read(arguments)); });
}

struct Command {
  std::string name;
  std::string about;  ///< For the help: "prints ...".
  void (*run)(const std::vector<std::string>& arguments);
};

/// Runs the command that the first argument names, with the other arguments. `about` says what the
/// program does.
/// @throws UsageError for an unknown command, TextRequest for --help, and whatever the command
/// throws.
void runCommand(const std::string& program, const std::string& about,
                const std::vector<Command>& commands, const std::vector<std::string>& arguments);

}  // namespace dtsdf
