/// map_tool: what is in a map file, and what can be made of it.
#include "tools/map_tool.h"

#include "program/commands.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

void run(const std::vector<std::string>& arguments) {
  runCommand("map_tool", "Reads map files (.dtsdf) that save_map and reconstruct write.",
             {{"info", "prints what is in a map file", printMapInfo},
              {"mesh", "saves the mesh of a map file", meshMap},
              {"bt", "saves free and occupied space as an OctoMap tree", saveOcTree},
              {"slice", "draws the distances to surfaces at one height", drawSlice},
              {"render", "renders depth, normals and colours from given poses", renderMap}},
             arguments);
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) { return dtsdf::runProgram("map_tool", argc, argv, dtsdf::run); }
