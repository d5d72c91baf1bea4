#include "tools/run_program.h"

#include <algorithm>
#include <cstdio>
#include <new>

#include "dtsdf_mapping/io/tum_frames.h"
#include "dtsdf_mapping/io/yaml_params.h"

namespace dtsdf {
namespace {

/// One line, whatever the text.
int reportError(const std::string& name, std::string text, int exit_code) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::fprintf(stderr, "%s: error: %s\n", name.c_str(), text.c_str());
  return exit_code;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "; ") + line;
  return text;
}

}  // namespace

MappingParams readSettings(const RunOptions& options) {
  ParamTree tree;
  if (!options.config_path.empty()) tree = loadYamlParams(options.config_path);
  for (const std::string& setting : options.settings) setParam(setting, tree);
  if (options.backend) tree["backend"] = *options.backend;
  if (options.threads) tree["threads"] = *options.threads;
  MappingParams params;
  ParamReader reader(tree);
  visitParams(params, reader);
  checkParams(params.mapper, reader);
  reader.finish();
  return params;
}

std::unique_ptr<FrameSource> openTumSource(const RunOptions& options) {
  TumOptions tum;
  tum.folder = options.tum_folder;
  tum.units_per_metre = options.units_per_metre;
  tum.pose_tolerance_s = options.pose_tolerance_s;
  tum.selection = options.frames;
  return openTumFrames(tum);
}

int runProgram(const std::string& name, int argc, const char* const* argv,
               const std::function<void(const std::vector<std::string>&)>& program) {
  try {
    program(std::vector<std::string>(argv + (argc > 0 ? 1 : 0), argv + argc));
    return 0;
  } catch (const UsageError& e) {
    return reportError(name, std::string(e.what()) + "; see " + name + " --help", 2);
  } catch (const ParamError& e) {
    return reportError(name, "invalid settings: " + joined(e.violations()), 1);
  } catch (const std::bad_alloc&) {
    return reportError(name, "out of memory; lower map/max_memory_mb or raise map/voxel_size_m", 1);
  } catch (const std::exception& e) {
    return reportError(name, e.what(), 1);
  }
}

}  // namespace dtsdf
