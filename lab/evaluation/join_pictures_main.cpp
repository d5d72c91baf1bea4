/// join_pictures: pictures side by side, each below its title.

#include "evaluation/picture_row.h"
#include "program/command_line.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct JoinOptions {
  std::string picture_path;
  std::vector<TitledPicture> pictures;
};

/// The title ends at the first =; a path may hold one, too.
TitledPicture readTitled(const std::string& text) {
  const size_t end = text.find('=');
  if (end == std::string::npos) throw UsageError("'" + text + "' is not of the form TITLE=FILE");
  return {text.substr(0, end), text.substr(end + 1)};
}

JoinOptions readOptions(const std::vector<std::string>& arguments) {
  JoinOptions options;
  CommandLine line("join_pictures", "OUT.png TITLE=FILE ...",
                   "Joins pictures side by side, each below its title.", kExitCodes);
  line.addText({"OUT.png", "", "the joined picture"}, options.picture_path);
  line.addList({"TITLE=FILE", "", "titles and pictures from left to right"},
               [&](const std::string& text) { options.pictures.push_back(readTitled(text)); });
  line.require("TITLE=FILE");
  line.parse(arguments);
  return options;
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  using namespace dtsdf;
  return runProgram("join_pictures", argc, argv, [](const std::vector<std::string>& arguments) {
    const JoinOptions options = readOptions(arguments);
    joinPictures(options.picture_path, options.pictures);
  });
}
