/// map_tool: what is in a map file, and what can be made of it.
#include "tools/map_tool.h"

#include <algorithm>
#include <iterator>

#include "program/command_line.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct Command {
  const char* name;
  const char* about;
  void (*run)(const std::vector<std::string>&);
};

constexpr Command kCommands[] = {
    {"info", "tells what is in a map file", tellAboutMap},
    {"mesh", "saves the mesh of a map file", meshMap},
    {"time", "tells how long it takes to load, copy and save a map", timeMap},
};

std::string help() {
  std::string text = "usage: map_tool COMMAND [arguments]\n\n"
                     "Works on map files (.dtsdf) of save_map and reconstruct.\n\nCommands\n";
  for (const Command& command : kCommands) {
    std::string name = command.name;
    name.resize(8, ' ');
    text += "  " + name + command.about + "\n";
  }
  return text + "\nmap_tool COMMAND --help tells more.\n" + kExitCodes + "\n";
}

std::string namesOfCommands() {
  std::string names;
  for (const Command& command : kCommands) {
    names += (names.empty() ? "" : ", ") + std::string(command.name);
  }
  return names;
}

void run(const std::vector<std::string>& arguments) {
  if (arguments.empty()) throw UsageError("a command is required: " + namesOfCommands());
  const std::string& name = arguments.front();
  if (name == "--help" || name == "-h") throw TextRequest(help());
  const auto* const command = std::find_if(std::begin(kCommands), std::end(kCommands),
                                           [&](const Command& c) { return c.name == name; });
  if (command == std::end(kCommands)) {
    throw UsageError("'" + name + "' is none of its commands: " + namesOfCommands());
  }
  command->run({arguments.begin() + 1, arguments.end()});
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) { return dtsdf::runProgram("map_tool", argc, argv, dtsdf::run); }
