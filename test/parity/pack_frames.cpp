// Converts frames of a TUM folder to the format described in lab/benchmark/raw_frames.h:
//   pack_frames TUM_DIR FIRST LAST STEP OUT_WITHOUT_SUFFIX [UNITS_PER_METRE]
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iostream>

#include "dtsdf_mapping/io/recording.h"

namespace {

void writePose(std::ostream& list, const Eigen::Isometry3d& T_W_C) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) list << T_W_C.matrix()(row, column) << ' ';
  }
  list << '\n';
}

int pack(const dtsdf::RecordingOptions& options, const std::string& out) {
  const auto source = dtsdf::openRecording(options);
  std::ofstream images(out + ".raw", std::ios::binary), list(out + ".txt");
  list << std::setprecision(17);
  size_t count = 0;
  while (const auto frame = source->next()) {
    const dtsdf::DepthFrame& depth = frame->depth;
    const dtsdf::Intrinsics& K = depth.intrinsics;
    if (count++ == 0) {
      list << depth.width << ' ' << depth.height << ' ' << K.fx << ' ' << K.fy << ' ' << K.cx << ' '
           << K.cy << ' ' << depth.unit_m << '\n';
    }
    const char* row = static_cast<const char*>(depth.data);
    for (int v = 0; v < depth.height; ++v, row += depth.row_bytes) {
      images.write(row, depth.width * sizeof(uint16_t));
    }
    writePose(list, depth.T_W_C);
  }
  std::cout << count << " frames in " << out << ".raw\n";
  return count > 0 && images && list ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6) {
    std::cerr << "usage: pack_frames TUM_DIR FIRST LAST STEP OUT_WITHOUT_SUFFIX "
                 "[UNITS_PER_METRE]\n";
    return 2;
  }
  dtsdf::RecordingOptions options;
  options.path = argv[1];
  options.format = "tum";
  options.selection.first = std::strtoul(argv[2], nullptr, 10);
  options.selection.last = std::strtoul(argv[3], nullptr, 10);
  options.selection.step = std::strtoul(argv[4], nullptr, 10);
  if (argc > 6) options.units_per_metre = std::strtod(argv[6], nullptr);
  try {
    return pack(options, argv[5]);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
