/// insert_object: puts a moving thing into a recording, to see what a map keeps of it.

#include <atomic>
#include <cstdio>
#include <filesystem>

#include "evaluation/depth_renderer.h"
#include "evaluation/parallel.h"
#include "evaluation/shared_options.h"
#include "program/run_program.h"

namespace dtsdf {
namespace {

struct InsertOptions {
  std::string input, output;
  MovingObject object;
  FrameSelection frames;
  bool then_without = false;
};

InsertOptions readOptions(const std::vector<std::string>& arguments) {
  InsertOptions options;
  CommandLine line("insert_object", "IN OUT --from X,Y,Z --to X,Y,Z [options]",
                   "Puts a box or a ball, which moves at constant speed from the first chosen "
                   "image to the last, into the depth images of the TUM folder IN, and writes the "
                   "chosen images to the TUM folder OUT. It is visible where it is nearer than the "
                   "measured depth, and where nothing was measured.");
  line.addText({"IN", "", "the recording"}, options.input);
  line.addText({"OUT", "", "the folder"}, options.output);
  addObjectOptions(line, options.object);
  addSelectionOptions(line, options.frames);
  line.addFlag("--then-without", "append the same images without the object", options.then_without);
  line.parse(arguments);
  return options;
}

/// The images of OUT: those with the object first, then those without.
class Insertion {
 public:
  explicit Insertion(const InsertOptions& options)
      : options_(options),
        views_(readViews(options.input)),
        chosen_(selectViews(options.frames, views_.poses_W_C.size())),
        writer_(options.output, views_.camera, poses()) {}

  size_t size() const { return (options_.then_without ? 2 : 1) * chosen_.size(); }
  size_t shown() const { return shown_; }

  void write(size_t index) {
    const size_t k = index % chosen_.size();
    std::vector<float> depth_m = readTumDepth(views_.depth_paths[chosen_[k]], views_.camera);
    if (index < chosen_.size()) {
      const double share =
          chosen_.size() > 1 ? static_cast<double>(k) / static_cast<double>(chosen_.size() - 1) : 0;
      const size_t pixels = composite(options_.object, options_.object.centreAt(share),
                                      views_.camera, views_.poses_W_C[chosen_[k]], depth_m);
      if (pixels > 0) ++shown_;
    }
    writer_.write(index, toTumDepth(depth_m));
  }

  void finish() const {
    writer_.finish(std::filesystem::path(options_.input).filename().string());
    std::printf("%zu images, the object is visible in %zu of the first %zu\n", size(), shown(),
                chosen_.size());
  }

 private:
  std::vector<Eigen::Isometry3d> poses() const {
    std::vector<Eigen::Isometry3d> poses_W_C;
    for (size_t i = 0; i < size(); ++i) {
      poses_W_C.push_back(views_.poses_W_C[chosen_[i % chosen_.size()]]);
    }
    return poses_W_C;
  }

  const InsertOptions& options_;
  Views views_;
  std::vector<size_t> chosen_;
  TumWriter writer_;
  std::atomic<size_t> shown_{0};
};

void insertObject(const InsertOptions& options) {
  Insertion insertion(options);
  forEachImage(insertion.size(), [&](size_t i) { insertion.write(i); });
  insertion.finish();
}

}  // namespace
}  // namespace dtsdf

int main(int argc, char** argv) {
  return dtsdf::runProgram("insert_object", argc, argv, dtsdf::readOptions, dtsdf::insertObject);
}
