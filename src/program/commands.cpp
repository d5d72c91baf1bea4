#include "program/commands.h"

#include <algorithm>

#include "program/command_line.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

std::string helpOn(const std::string& program, const std::string& about,
                   const std::vector<Command>& commands) {
  constexpr size_t kNameWidth = 8;
  std::string text = "usage: " + program + " COMMAND [arguments]\n\n" + about + "\n\nCommands\n";
  for (const Command& command : commands) {
    std::string name = command.name;
    name.resize(kNameWidth, ' ');
    text += "  " + name + command.about + "\n";
  }
  return text + "\n" + program + " COMMAND --help prints more.\n" + kExitCodes + "\n";
}

std::string namesOf(const std::vector<Command>& commands) {
  std::string names;
  for (const Command& command : commands) names += (names.empty() ? "" : ", ") + command.name;
  return names;
}

}  // namespace

void runCommand(const std::string& program, const std::string& about,
                const std::vector<Command>& commands, const std::vector<std::string>& arguments) {
  if (arguments.empty()) throw UsageError("a command is required: " + namesOf(commands));
  const std::string& name = arguments.front();
  if (name == "--help" || name == "-h") throw TextRequest(helpOn(program, about, commands));
  const auto command = std::find_if(commands.begin(), commands.end(),
                                    [&](const Command& c) { return c.name == name; });
  if (command == commands.end()) {
    throw UsageError("'" + name + "': no such command; commands: " + namesOf(commands));
  }
  command->run({arguments.begin() + 1, arguments.end()});
}

}  // namespace dtsdf
