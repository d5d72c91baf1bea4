/// Programs that have several commands, each with a command line of its own.
#pragma once

#include <string>
#include <vector>

namespace dtsdf {

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
