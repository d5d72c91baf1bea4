/// tiles: a map that is larger than one machine, made in tiles by as many processes as there are.
#include <algorithm>
#include <iterator>

#include "program/command_line.h"
#include "program/run_program.h"
#include "tiles/commands.h"

namespace dtsdf {
namespace {

struct Command {
  const char* name;
  const char* about;
  void (*run)(const std::vector<std::string>&);
};

constexpr Command kCommands[] = {
    {"plan", "cuts the space of recordings into tiles", planCommand},
    {"run", "makes all tiles and joins them, under mpirun", runCommand},
    {"status", "tells which tiles are done", statusCommand},
    {"fuse", "makes one tile", fuseCommand},
    {"merge", "joins the tiles into one mesh and one map", mergeCommand},
    {"slurm", "prints an array job that makes all tiles", slurmCommand},
};

std::string help() {
  std::string text = "usage: tiles COMMAND [arguments]\n\n"
                     "Makes a map in tiles, with any number of processes and machines, and the "
                     "same bytes as\nreconstruct.\n\nCommands\n";
  for (const Command& command : kCommands) {
    std::string name = command.name;
    name.resize(8, ' ');
    text += "  " + name + command.about + "\n";
  }
  return text + "\ntiles COMMAND --help tells more.\n" + kExitCodes + "\n";
}

void run(const std::vector<std::string>& arguments) {
  if (arguments.empty()) throw UsageError("a command is required");
  const std::string& name = arguments.front();
  if (name == "--help" || name == "-h") throw TextRequest(help());
  const auto* const command = std::find_if(std::begin(kCommands), std::end(kCommands),
                                           [&](const Command& c) { return c.name == name; });
  if (command == std::end(kCommands)) throw UsageError("'" + name + "' is none of its commands");
  command->run({arguments.begin() + 1, arguments.end()});
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) { return dtsdf::runProgram("tiles", argc, argv, dtsdf::run); }
