/// Tests saving to a disk that is full, read-only or gone. The response must contain the error and
/// what to do about it, existing files must stay intact, and the node must continue.
#include <dtsdf_mapping/LoadMap.h>
#include <dtsdf_mapping/SaveMap.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "ros/support/wall_camera.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

struct FileAnswer {
  bool success;
  std::string message;
};

template <class Service>
FileAnswer call(const std::string& service, const std::string& file_name) {
  const auto response = callFile<Service>(service, file_name);
  return {response.success != 0, response.message};
}

FileAnswer save(const std::string& file_name) {
  return fs::path(file_name).extension() == ".dtsdf"
             ? call<dtsdf_mapping::SaveMap>("save_map", file_name)
             : call<dtsdf_mapping::SaveMesh>("save_mesh", file_name);
}

/// Contents of all files below a folder, by path.
std::map<std::string, std::string> filesIn(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    files[entry.path().string()] = entry.is_regular_file() ? readBytes(entry.path().string()) : "";
  }
  return files;
}

const char* const kNames[] = {"mesh.ply", "mesh.glb", "mesh.obj", "mesh.stl", "map.dtsdf"};

class Disk : public WallCamera {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(WallCamera::SetUp());
    fuseFrame();
    for (const char* name : kNames) {
      const FileAnswer answer = save(name);
      ASSERT_TRUE(answer.success) << answer.message;
    }
  }
  void TearDown() override {
    fs::remove(folder_ + ".fault");
    fs::remove_all(folder_);
  }

  /// Fuses a frame from a new position, so that the next saved files differ.
  void fuseFrame() {
    const auto fused = static_cast<double>(status_.status().frames_fused);
    WallCamera::fuseFrame({0.001 * (fused + 1.0), 0.0, 0.0});
  }

  void breakDisk(const std::string& how) const { std::ofstream(folder_ + ".fault") << how; }
  void mendDisk() const { fs::remove(folder_ + ".fault"); }

  static void expectOneSentence(const FileAnswer& answer, const std::string& what,
                                const std::string& advice) {
    EXPECT_FALSE(answer.success);
    EXPECT_NE(answer.message.find(what), std::string::npos) << answer.message;
    EXPECT_NE(answer.message.find(advice), std::string::npos) << answer.message;
    EXPECT_EQ(answer.message.find('\n'), std::string::npos) << answer.message;
  }

  void expectSavesFail(const std::string& what, const std::string& advice) {
    const auto before = filesIn(folder_);
    ASSERT_EQ(before.size(), std::size(kNames));
    fuseFrame();
    for (const char* name : kNames) expectOneSentence(save(name), what, advice);
    EXPECT_TRUE(filesIn(folder_) == before) << "a failed save should neither change nor add files";
    fuseFrame();  // the node must still work
    mendDisk();
    for (const char* name : kNames) EXPECT_TRUE(save(name).success);
    const auto after = filesIn(folder_);
    ASSERT_EQ(after.size(), before.size());
    for (const auto& [path, bytes] : after) EXPECT_TRUE(bytes != before.at(path)) << path;
  }

  const std::string folder_ = outputFolder();
};

TEST_F(Disk, SavesFailWhenFull) {
  breakDisk("full");
  expectSavesFail("No space left on device",
                  "choose another file name or folder, or free some space");
}

TEST_F(Disk, SavesFailWhenReadOnly) {
  breakDisk("read_only");
  expectOneSentence(save("new/mesh.ply"), "Read-only file system",
                    "choose another file name or folder");
  expectSavesFail("Read-only file system", "choose another file name or folder");
}

TEST_F(Disk, SavesFailWhenItDisappears) {
  breakDisk("gone");
  expectSavesFail("No such file or directory", "choose another file name or folder");
}

TEST_F(Disk, SavesRecreateAMissingFolder) {
  fs::remove_all(folder_);
  expectOneSentence(call<dtsdf_mapping::LoadMap>("load_map", "map.dtsdf"), "map.dtsdf", "cannot");
  fuseFrame();
  for (const char* name : kNames) {
    const FileAnswer answer = save(name);  // creates the folder
    EXPECT_TRUE(answer.success) << answer.message;
  }
  EXPECT_EQ(filesIn(folder_).size(), std::size(kNames));
  fs::remove_all(folder_);
  std::ofstream(folder_) << "a file in its place";
  for (const char* name : kNames) {
    expectOneSentence(save(name), "Not a directory", "choose another file name or folder");
  }
  EXPECT_EQ(readBytes(folder_), "a file in its place");
  fuseFrame();
}

}  // namespace
}  // namespace dtsdf
