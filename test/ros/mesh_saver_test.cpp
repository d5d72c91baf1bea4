#include "ros/output/mesh_saver.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

TEST(MeshPath, LiesUnderTheOutputDirectory) {
  const TemporaryFolder folder;
  const std::string root = fs::canonical(folder.path()).string();
  EXPECT_EQ(resolveMeshPath(root, "mesh.ply"), root + "/mesh.ply");
  EXPECT_EQ(resolveMeshPath(root + "/", "a/b/mesh.OBJ"), root + "/a/b/mesh.OBJ");
  EXPECT_EQ(resolveMeshPath(root, "a/../mesh.stl"), root + "/mesh.stl");
  EXPECT_EQ(resolveMeshPath(root, root + "/mesh.ply"), root + "/mesh.ply");
  EXPECT_EQ(resolveMeshPath(root + "/not/there/yet", "mesh.ply"), root + "/not/there/yet/mesh.ply");
}

TEST(MeshPath, StartsAtTheHomeFolderOnRequest) {
  const char* home = std::getenv("HOME");
  if (home == nullptr) GTEST_SKIP() << "HOME is not set";
  EXPECT_EQ(resolveMeshPath("~/meshes", "mesh.ply"),
            fs::weakly_canonical(home).string() + "/meshes/mesh.ply");
}

TEST(MeshPath, RefusesWhatLeadsOut) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "out");
  fs::create_directories(folder / "outside");
  fs::create_directory_symlink(folder / "outside", folder / "out/link");
  const std::string root = folder / "out";
  for (const char* name : {"../mesh.ply", "a/../../mesh.ply", "/mesh.ply", "link/mesh.ply",
                           "../outside/mesh.ply", "../out.ply", "", ".", "..", "mesh", "mesh.txt",
                           "mesh.ply/"}) {
    EXPECT_THROW(resolveMeshPath(root, name), std::runtime_error) << "'" << name << "'";
  }
}

}  // namespace
}  // namespace dtsdf
