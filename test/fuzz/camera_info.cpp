// Fuzzes the reader of camera_info.yaml.
#include "fuzz/fuzz_input.h"
#include "io/camera_file.h"

using namespace dtsdf;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const InputFile file(data, size);
  expectAnswer([&] {
    const CameraInfo info = loadCameraInfo(file.path());
    require(info.width > 0 && info.height > 0 && info.intrinsics.fx > 0.0f,
            "a size and fx above 0");
  });
  return 0;
}
