/// How every program runs and ends: its commands, its exit code, and one line for what went wrong.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace dtsdf {

/// Runs a program and turns what it throws into one line on standard error, or for a TextRequest
/// into that text on standard output. What cannot be printed there is an error.
/// @return exit code: 0, 1 for an error, 2 for a wrong command line or setting.
int runProgram(const std::string& name, int argc, const char* const* argv,
               const std::function<void(const std::vector<std::string>&)>& program);

/// Runs a program whose options are read first.
template <class Read, class Run>
int runProgram(const std::string& name, int argc, const char* const* argv, const Read& read,
               const Run& run) {
  return runProgram(name, argc, argv, [&](const auto& arguments) { run(read(arguments)); });
}

struct Command {
  std::string name;
  std::string about;  ///< Half a sentence for the help.
  void (*run)(const std::vector<std::string>& arguments);
};

/// Runs the command that the arguments begin with, with those behind it. `about` says what the
/// program does.
/// @throws UsageError for none of the commands, TextRequest for --help, what the command throws.
void runCommand(const std::string& program, const std::string& about,
                const std::vector<Command>& commands, const std::vector<std::string>& arguments);

}  // namespace dtsdf
