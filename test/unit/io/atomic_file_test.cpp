#include "io/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "support/page_faults.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(AtomicFile, ReplacesTheOldFileOnCommit) {
  const TemporaryFolder folder;
  writeBytes(folder / "a.txt", "old");
  AtomicFile file(folder / "a.txt");
  file.write("new");
  EXPECT_EQ(readBytes(folder / "a.txt"), "old");
  file.commit();
  EXPECT_EQ(readBytes(folder / "a.txt"), "new");
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(AtomicFile, LeavesOtherFilesAlone) {
  const TemporaryFolder folder;
  writeBytes(folder / ".a.txt.0.tmp", "somebody's");
  writeBytes(folder / "a.txt.0.tmp", "somebody's, too");
  writeFileAtomically(folder / "a.txt", "new");
  EXPECT_EQ(readBytes(folder / "a.txt"), "new");
  EXPECT_EQ(readBytes(folder / ".a.txt.0.tmp"), "somebody's");
  EXPECT_EQ(readBytes(folder / "a.txt.0.tmp"), "somebody's, too");
}

TEST(AtomicFile, FollowsTheUmask) {
  const TemporaryFolder folder;
  const mode_t mask = umask(027);
  writeFileAtomically(folder / "a.txt", "new");
  umask(mask);
  struct stat status {};
  ASSERT_EQ(stat((folder / "a.txt").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
}

TEST(AtomicFile, ConcurrentSavesDoNotInterfere) {
  const TemporaryFolder folder;
  AtomicFile slow(folder / "a.txt");
  slow.write("slow");
  writeFileAtomically(folder / "a.txt", "fast");
  slow.commit();
  EXPECT_EQ(readBytes(folder / "a.txt"), "slow");
}

TEST(AtomicFile, RefusesNamesWithNul) {
  const TemporaryFolder folder;
  EXPECT_NE(errorOf([&] { writeFileAtomically(folder / std::string("a\0b", 3), "new"); }), "");
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(AtomicFile, LeavesNothingWithoutCommit) {
  const TemporaryFolder folder;
  {
    AtomicFile file(folder / "a.txt");
    file.write("new");
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(AtomicFile, KeepsTheOldFileWhenTheDiskIsFull) {
  const TemporaryFolder folder;
  writeBytes(folder / "a.bin", "old");
  std::string error;
  {
    const FileSizeLimit limit(1 << 20);
    error = errorOf([&] { writeFileAtomically(folder / "a.bin", std::string(4 << 20, 'x')); });
  }
  EXPECT_TRUE(contains(error, folder / "a.bin")) << error;
  EXPECT_TRUE(contains(error, "free some space")) << error;
  EXPECT_EQ(readBytes(folder / "a.bin"), "old");
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(AtomicFile, CreatesMissingFolders) {
  const TemporaryFolder folder;
  writeFileAtomically(folder / "one/two/a.txt", "text");
  EXPECT_EQ(readBytes(folder / "one/two/a.txt"), "text");
}

TEST(AtomicFile, WritesOnlyRegularFiles) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "sub");
  writeBytes(folder / "file", "text");
  for (const std::string& path : {folder / "sub", std::string("/dev/null"), std::string(),
                                  folder / "file/below.txt", folder / "sub/"}) {
    const std::string error = errorOf([&] { prepareOutputFile(path); });
    EXPECT_TRUE(contains(error, "cannot write '" + path + "'")) << path << ": " << error;
    EXPECT_NE(errorOf([&] { AtomicFile file(path); }), "") << path;
  }
  EXPECT_FALSE(std::filesystem::is_regular_file("/dev/null"));
}

}  // namespace
}  // namespace dtsdf
