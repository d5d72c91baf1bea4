/// prove_scenes: fuses analytic scenes and prints measurements of the maps, with their limits.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>

#include "params/text.h"
#include "program/progress_bar.h"
#include "program/run_program.h"
#include "scenes/scene_case.h"
#include "threads/parallel.h"
#include "tools/run_options.h"

namespace dtsdf {
namespace {

struct ProveOptions {
  std::vector<double> voxels_mm = {20.0, 10.0, 5.0};
  std::vector<std::string> scenes;
  int image_width = 320;
  int jobs = 1;
  bool quick = false;
  RunOptions run;
};

ProveOptions parseOptions(const std::vector<std::string>& arguments) {
  ProveOptions options;
  CommandLine line("prove_scenes", "[options]",
                   "Fuses views of analytic scenes at several voxel sizes and prints a Markdown "
                   "table of measurements of the maps, each with its limit.");
  line.add({"--voxels", "MM,...", "voxel sizes in millimetres (default 20,10,5)"},
           [&](const std::string& text) { options.voxels_mm = readNumbers(text); });
  line.addList({"--scene", "TEXT ...", "only cases whose name contains one of these texts"},
               [&](const std::string& text) { options.scenes.push_back(text); });
  line.addFlag("--quick", "only the cases that the tests run", options.quick);
  line.addNumber({"--width", "PIXELS", "width of the images of the room scenes"},
                 options.image_width, {64, 4096});
  line.addNumber({"--jobs", "N", "number of cases that run at the same time"}, options.jobs,
                 {1, 1024});
  line.beginGroup("Settings");
  addMapperOptions(line, options.run);
  line.parse(arguments);
  return options;
}

std::vector<SceneCase> selectCases(const ProveOptions& options) {
  std::vector<SceneCase> cases = allSceneCases();
  const auto isOut = [&](const SceneCase& c) {
    const auto isNamed = [&](const std::string& text) {
      return c.name().find(text) != std::string::npos;
    };
    return (options.quick && !c.quick) ||
           (!options.scenes.empty() &&
            std::none_of(options.scenes.begin(), options.scenes.end(), isNamed));
  };
  cases.erase(std::remove_if(cases.begin(), cases.end(), isOut), cases.end());
  if (cases.empty()) throw UsageError("no case matches --scene and --quick");
  return cases;
}

/// Indexed by case, then by voxel size.
using Results = std::vector<std::vector<std::vector<Figure>>>;

Results measureCases(const ProveOptions& options, const RunSettings& settings,
                     const std::vector<SceneCase>& cases) {
  const size_t voxels = options.voxels_mm.size(), count = cases.size() * voxels;
  Results results(cases.size(), std::vector<std::vector<Figure>>(voxels));
  ProgressBar progress("cases", count);
  std::mutex mutex;  // guards `done` and `progress`
  size_t done = 0;
  parallelFor(count, options.jobs, [&](size_t i) {
    const size_t c = i / voxels, v = i % voxels;
    SceneSetup setup{settings.params.mapper, settings.rules, options.image_width};
    setup.params.map.voxel_size_m = static_cast<float>(0.001 * options.voxels_mm[v]);
    results[c][v] = cases[c].measure(setup);
    const std::lock_guard<std::mutex> lock(mutex);
    progress.show(++done);
  });
  return results;
}

/// The value, in bold if it is outside its limits; a dash if it is not measured at this voxel size.
std::string cellOf(const std::vector<Figure>& figures, const Figure& wanted) {
  const auto found = std::find_if(figures.begin(), figures.end(),
                                  [&](const Figure& figure) { return figure.name == wanted.name; });
  if (found == figures.end()) return "–";
  const double size = std::abs(found->value);
  const int digits = size == 0.0 || size >= 99.95 ? 0 : (size >= 9.95 ? 1 : 2);
  const std::string text = formatted("%.*f", digits, found->value);
  return found->holds() ? text : "**" + text + "**";
}

/// The limits of a measurement at all voxel sizes, without duplicates.
std::string boundsOf(const std::vector<std::vector<Figure>>& by_voxel, const Figure& wanted) {
  std::vector<std::string> bounds;
  for (const auto& figures : by_voxel) {
    for (const Figure& figure : figures) {
      const std::string bound = describeBound(figure);
      if (figure.name == wanted.name && figure.isBounded() &&
          std::find(bounds.begin(), bounds.end(), bound) == bounds.end()) {
        bounds.push_back(bound);
      }
    }
  }
  std::string text;
  for (const std::string& bound : bounds) text += (text.empty() ? "" : "; ") + bound;
  return text;
}

/// The measurements of a case at all voxel sizes, without duplicates.
std::vector<Figure> figuresOf(const std::vector<std::vector<Figure>>& by_voxel) {
  std::vector<Figure> all;
  for (const auto& figures : by_voxel) {
    for (const Figure& figure : figures) {
      if (std::none_of(all.begin(), all.end(),
                       [&](const Figure& known) { return known.name == figure.name; })) {
        all.push_back(figure);
      }
    }
  }
  return all;
}

void printTable(const ProveOptions& options, const std::vector<SceneCase>& cases,
                const Results& results) {
  std::string head = "| scene | metric | unit | limit |", rule = "|---|---|---|---|";
  for (const double voxel_mm : options.voxels_mm) {
    head += formatted(" %g mm |", voxel_mm);
    rule += "---|";
  }
  std::printf("%s\n%s\n", head.c_str(), rule.c_str());
  for (size_t c = 0; c < cases.size(); ++c) {
    for (const Figure& figure : figuresOf(results[c])) {
      std::printf("| %s | %s | %s | %s |", cases[c].name().c_str(), figure.name.c_str(),
                  figure.unit.c_str(), boundsOf(results[c], figure).c_str());
      for (const auto& figures : results[c]) std::printf(" %s |", cellOf(figures, figure).c_str());
      std::printf("\n");
    }
  }
}

/// Prints how many limits are met at each voxel size.
void printKept(const ProveOptions& options, const Results& results) {
  std::string text;
  for (size_t v = 0; v < options.voxels_mm.size(); ++v) {
    size_t kept = 0, bounds = 0;
    for (const auto& by_voxel : results) {
      for (const Figure& figure : by_voxel[v]) {
        bounds += figure.isBounded();
        kept += figure.isBounded() && figure.holds();
      }
    }
    text += (text.empty() ? "" : ", ") + std::to_string(kept) + " of " + std::to_string(bounds) +
            formatted(" at %g mm", options.voxels_mm[v]);
  }
  std::printf("\nLimits met: %s.\n", text.c_str());
}

void run(const ProveOptions& options) {
  const std::vector<SceneCase> cases = selectCases(options);
  const RunSettings settings = readSettings(options.run);
  const Results results = measureCases(options, settings, cases);
  printTable(options, cases, results);
  printKept(options, results);
  std::printf("Device: %s\n",
              makeProbedMapper(settings.params.mapper, settings.rules)->backendName().c_str());
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("prove_scenes", argc, argv, dtsdf::parseOptions, dtsdf::run);
}
