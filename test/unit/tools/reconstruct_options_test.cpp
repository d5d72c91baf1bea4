#include "tools/reconstruct_options.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

using Arguments = std::vector<std::string>;

/// The text of the usage error, or an empty string if the arguments are accepted.
std::string parseErrorOf(const Arguments& arguments) {
  return errorOf<UsageError>([&] { parseReconstructOptions(arguments); });
}

TEST(ReconstructOptions, ReadsBagOptions) {
  const ReconstructOptions options = parseReconstructOptions(
      {"--bag", "a.bag", "--depth-topic", "/d", "--info-topic", "/i", "--mesh", "o.stl"});
  EXPECT_EQ(options.recording.path, "a.bag");
  EXPECT_EQ(options.recording.format, "bag");
  EXPECT_EQ(options.recording.depth_topic, "/d");
  EXPECT_EQ(options.recording.info_topic, "/i");
}

TEST(ReconstructOptions, ReadsARecordingOfAnyFormat) {
  const ReconstructOptions guessed = parseReconstructOptions({"room", "--mesh", "o.ply"});
  EXPECT_EQ(guessed.recording.path, "room");
  EXPECT_EQ(guessed.recording.format, "");
  EXPECT_FALSE(guessed.recording.intrinsics);
  EXPECT_FALSE(guessed.recording.units_per_metre);

  const ReconstructOptions options = parseReconstructOptions(
      {"room", "--format", "icl", "--intrinsics", "481.2,-480,319.5,239.5", "--poses", "slam.tum",
       "--pose-tolerance=0.1", "--threads", "2", "--mesh-every", "10", "--mesh", "o.ply"});
  EXPECT_EQ(options.recording.format, "icl");
  EXPECT_EQ(options.recording.poses_path, "slam.tum");
  EXPECT_EQ(options.recording.pose_tolerance_s, 0.1);
  EXPECT_EQ(options.settings, Arguments({"threads=2"}));
  EXPECT_EQ(options.mesh_every, 10u);
  EXPECT_EQ(options.recording.intrinsics->fx, 481.2f);
  EXPECT_EQ(options.recording.intrinsics->fy, -480.0f);
  EXPECT_EQ(options.recording.intrinsics->cy, 239.5f);
}

TEST(ReconstructOptions, RefusesOptionsOfOtherInputs) {
  const auto errorFor = [](const Arguments& arguments) {
    return errorOf([&] { checkReadingOptions(parseReconstructOptions(arguments)); });
  };
  EXPECT_EQ(errorFor({"--bag", "b", "--mesh", "o.ply", "--depth-topic", "/d"}), "");
  EXPECT_NE(errorFor({"--bag", "b", "--mesh", "o.ply", "--depth-scale", "1"}), "");
  EXPECT_NE(errorFor({"--bag", "b", "--mesh", "o.ply", "--intrinsics=1,-1,1,1"}), "");
  EXPECT_NE(errorFor({"--tum", "d", "--mesh", "o.ply", "--depth-topic", "/d"}), "");
  EXPECT_NE(errorFor({"d", "--format", "icl", "--mesh", "o.ply", "--info-topic", "/d"}), "");
  EXPECT_NE(errorFor({"--tum", "d", "--mesh", "o.ply", "--mask-topic", "/m"}), "");
  EXPECT_NE(errorFor({"--tum", "d", "--mesh", "o.ply", "--imu-topic", "/i"}), "");
  const Arguments journal = {"j", "--format", "journal", "--mesh", "o.ply"};
  EXPECT_EQ(errorFor(journal), "");
  for (const std::string option :
       {"--frames=0:9", "--frames=1:", "--frames=::2", "--intrinsics=1,1,1,1", "--depth-scale=1",
        "--pose-convention=body", "--pose-tolerance=1", "--skip-bad"}) {
    Arguments arguments = journal;
    arguments.push_back(option);
    EXPECT_EQ(errorFor(arguments), option.substr(0, option.find('=')) +
                                       " is for recordings, and 'j' is read as journal");
  }
}

TEST(ReconstructOptions, ErrorsNameWhatIsWrong) {
  const Arguments good = {"--tum", "dir", "--mesh", "o.ply"};
  const std::pair<Arguments, std::string> additions[] = {
      {{"--format", "icl"}, "--format"},
      {{"--format", "icl2"}, "--format: 'icl2'"},
      {{"--intrinsics", "1,2,3,x"}, "--intrinsics"},
      {{"--intrinsics", "1,0,3,4"}, "--intrinsics"},
      {{"--mesh-every", "0"}, "--mesh-every"},
      {{"--depth-scale", "0"}, "--depth-scale"},
      {{"--frames", "5:1"}, "--frames"},
      {{"--set", "key"}, "--set"},
      {{"--set", "key=1", "stray"}, "--set"},
      {{"--bag", "a.bag"}, "one of INPUT, --tum and --bag"},
      {{"--report", "o.ply"}, "same file"},
  };
  EXPECT_EQ(parseErrorOf(good), "");
  for (const auto& [addition, expected] : additions) {
    Arguments arguments = good;
    arguments.insert(arguments.end(), addition.begin(), addition.end());
    EXPECT_NE(parseErrorOf(arguments).find(expected), std::string::npos)
        << addition[0] << " -> " << parseErrorOf(arguments);
  }
  EXPECT_NE(parseErrorOf({"--tum", "dir", "--report", "r.json"}).find("--mesh"), std::string::npos);
  EXPECT_EQ(parseErrorOf({"--tum", "dir", "--save-map", "m.dtsdf"}), "");
  EXPECT_EQ(parseErrorOf({"--tum", "dir", "--trajectory", "t.txt"}), "");
  EXPECT_NE(parseErrorOf({"--tum", "dir", "--mesh", "o.xyz"}).find(".ply"), std::string::npos);
  EXPECT_NE(parseErrorOf({"dir", "other", "--mesh", "o.ply"}).find("other"), std::string::npos);
}

TEST(FrameSelectionText, MayOmitParts) {
  const std::tuple<std::string, size_t, size_t, size_t> cases[] = {
      {"1:9:2", 1, 9, 2},
      {"5:", 5, FrameSelection{}.last, 1},
      {":7", 0, 7, 1},
      {"::3", 0, FrameSelection{}.last, 3},
      {"3:3", 3, 3, 1}};
  for (const auto& [text, first, last, step] : cases) {
    const FrameSelection selection = parseFrameSelection(text);
    EXPECT_EQ(selection.first, first) << text;
    EXPECT_EQ(selection.last, last) << text;
    EXPECT_EQ(selection.step, step) << text;
  }
}

TEST(FrameSelectionText, RefusesOtherForms) {
  for (const char* text :
       {"", "5", "a:b", "1:2:0", "1:2:3:4", "1:2:3:", "-1:5", "9:1", "1.5:2", "1 :2"}) {
    EXPECT_NE(errorOf([&] { parseFrameSelection(text); }), "") << text;
  }
}

}  // namespace
}  // namespace dtsdf
