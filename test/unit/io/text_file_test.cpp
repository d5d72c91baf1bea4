#include "io/text_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "dtsdf_mapping/io/yaml_params.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

TEST(TextFile, RefusesDevicesAndPipes) {
  const TemporaryFolder folder;
  const std::string fifo = folder / "list.txt";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/zero", folder / "zero.txt");
  for (const std::string& path : {fifo, folder / "zero.txt", std::string("/dev/zero")}) {
    const std::string error = errorOf([&] { readList(path, "give a list"); });
    EXPECT_NE(error.find(path), std::string::npos) << error;
    EXPECT_NE(error.find("a device or a pipe"), std::string::npos) << error;
    EXPECT_NE(error.find("give a list"), std::string::npos) << error;
    EXPECT_NE(errorOf([&] { loadYamlParams(path); }), "");
  }
}

TEST(TextFile, RefusesFilesOverOneGibibyte) {
  const TemporaryFolder folder;
  writeBytes(folder / "huge.txt", "");
  std::filesystem::resize_file(folder / "huge.txt", (uintmax_t{1} << 30) + 1);  // a sparse file
  EXPECT_NE(errorOf([&] { readTextFile(folder / "huge.txt", ""); }).find("1 GiB"),
            std::string::npos);
}

}  // namespace
}  // namespace dtsdf
