#include "ros/common/requests.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "params/printable.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kExtensions = {".ply", ".obj", ".stl"};

std::string resolve(const std::string& directory, const std::string& name) {
  return resolveOutputPath(directory, name, kExtensions);
}

TEST(OutputPath, LiesUnderTheOutputDirectory) {
  const TemporaryFolder folder;
  const std::string root = fs::canonical(folder.path()).string();
  EXPECT_EQ(resolve(root, "mesh.ply"), root + "/mesh.ply");
  EXPECT_EQ(resolve(root + "/", "a/b/mesh.OBJ"), root + "/a/b/mesh.OBJ");
  EXPECT_EQ(resolve(root, "a/../mesh.stl"), root + "/mesh.stl");
  EXPECT_EQ(resolve(root, root + "/mesh.ply"), root + "/mesh.ply");
  EXPECT_EQ(resolve(root + "/not/there/yet", "mesh.ply"), root + "/not/there/yet/mesh.ply");
  EXPECT_EQ(resolveOutputPath(root, "a.dtsdf", {".dtsdf"}), root + "/a.dtsdf");
  EXPECT_EQ(resolveOutputPath(root, "/elsewhere/a.dtsdf", {".dtsdf"}, true), "/elsewhere/a.dtsdf");
}

TEST(OutputPath, ExpandsTheHomeFolder) {
  const char* home = std::getenv("HOME");
  if (home == nullptr) GTEST_SKIP() << "HOME is not set";
  EXPECT_EQ(resolve("~/meshes", "mesh.ply"),
            fs::weakly_canonical(home).string() + "/meshes/mesh.ply");
  EXPECT_EQ(resolve("~/", "~/mesh.ply"), fs::weakly_canonical(home).string() + "/mesh.ply");
  EXPECT_EQ(expandHome("~/map.dtsdf", "it"), std::string(home) + "/map.dtsdf");
  EXPECT_EQ(expandHome("/a/~/b", "it"), "/a/~/b");
}

TEST(OutputPath, RefusesPathsOutsideTheOutputDirectory) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "out");
  fs::create_directories(folder / "outside");
  writeBytes(folder / "outside/mesh.ply", "");
  fs::create_directory_symlink(folder / "outside", folder / "out/link");
  fs::create_symlink(folder / "outside/mesh.ply", folder / "out/file_link.ply");
  const std::string root = folder / "out";
  for (const char* name : {"../mesh.ply", "a/../../mesh.ply", "/mesh.ply", "link/mesh.ply",
                           "file_link.ply", "../outside/mesh.ply", "../out.ply", "", ".", "..",
                           "mesh", "mesh.txt", "mesh.ply/", "mesh.dtsdf"}) {
    EXPECT_THROW(resolve(root, name), std::runtime_error) << "'" << name << "'";
  }
}

/// For the operating system, the first NUL ends a name, but a check of the extension would look
/// past it.
TEST(OutputPath, RefusesControlCharacters) {
  const TemporaryFolder folder;
  for (const std::string& name :
       {std::string("a.txt\0.ply", 10), std::string("a\n.ply"), std::string("\x1b[2J.ply"),
        std::string("\u0085.ply"), std::string("\u009b2J.ply"), std::string("\u202eylp.a.ply"),
        std::string("\x9b.ply")}) {
    const std::string error = errorOf([&] { resolve(folder.path(), name); });
    EXPECT_NE(error.find("control character"), std::string::npos) << error;
    EXPECT_FALSE(hasControlCharacter(error));
  }
  EXPECT_EQ(errorOf([&] { resolve(folder.path(), "K\u00fcche \u53f0\u6240.ply"); }), "");
}

TEST(OutputPath, RefusesCyclicLinks) {
  const TemporaryFolder folder;
  fs::create_symlink("loop.ply", folder / "loop.ply");
  for (const char* name : {"loop.ply", "loop.ply/a.ply"}) {
    EXPECT_THROW(resolve(folder.path(), name), std::runtime_error) << name;
  }
}

}  // namespace
}  // namespace dtsdf
