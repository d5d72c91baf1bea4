#include "program/run_program.h"

#include <algorithm>
#include <cstdio>
#include <new>

#include "dtsdf_mapping/params/param_set.h"
#include "params/printable.h"
#include "params/text.h"
#include "program/command_line.h"

namespace dtsdf {
namespace {

/// Prints an error as one printable line, since it may contain text from files.
int reportError(const std::string& name, std::string text, int exit_code) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::fprintf(stderr, "%s: error: %s\n", name.c_str(), printableMessage(text).c_str());
  return exit_code;
}

/// Flushes standard output. Reports an error if any output has failed, for example on a full disk.
int flushOutput(const std::string& name) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return 0;
  return reportError(name, "cannot write to standard output; is the disk full?", 1);
}

}  // namespace

int runProgram(const std::string& name, int argc, const char* const* argv,
               const std::function<void(const std::vector<std::string>&)>& program) {
  try {
    program(std::vector<std::string>(argv + (argc > 0 ? 1 : 0), argv + argc));
    return flushOutput(name);
  } catch (const TextRequest& e) {
    std::fputs(e.what(), stdout);
    return flushOutput(name);
  } catch (const UsageError& e) {
    return reportError(name, std::string(e.what()) + "; see " + name + " --help", 2);
  } catch (const ParamError& e) {
    return reportError(name, "invalid settings: " + joined(e.violations(), "; "), 2);
  } catch (const std::bad_alloc&) {
    return reportError(name, "out of memory; lower map/max_memory_mb or raise map/voxel_size_m", 1);
  } catch (const std::exception& e) {
    return reportError(name, errorText(e), 1);
  }
}

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
