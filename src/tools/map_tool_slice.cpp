// map_tool slice: draws the distances to surfaces at one height.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "io/atomic_file.h"
#include "io/colour_codes.h"
#include "params/text.h"
#include "planning/ground_grid.h"
#include "program/run_program.h"
#include "tools/map_tool.h"

namespace dtsdf {
namespace {

using Colour = std::array<uint8_t, 3>;

constexpr Colour kUnknown = {150, 150, 150}, kSurface = {0, 0, 0};

/// From red (0) through yellow and green to blue (1).
Colour colourOf(double share) {
  constexpr double kStops[5][3] = {
      {200, 30, 30}, {245, 160, 40}, {245, 235, 90}, {90, 190, 110}, {50, 90, 190}};
  const double at = 4.0 * std::clamp(share, 0.0, 1.0);
  const int stop = std::min(3, static_cast<int>(at));
  Colour colour{};
  for (size_t i = 0; i < 3; ++i) {
    const double low = kStops[stop][i], high = kStops[stop + 1][i];
    colour[i] = static_cast<uint8_t>(low + (at - stop) * (high - low) + 0.5);
  }
  return colour;
}

RgbImage draw(const std::vector<SliceCell>& slice, double most_m, int pixels) {
  GridBox bounds;  // cells that the picture shows
  for (const SliceCell& cell : slice) bounds.extend(Eigen::Vector2i(cell.cell.x, cell.cell.y));
  constexpr int64_t kMostPixels = int64_t{1} << 28;
  const Eigen::Vector2i cells = sizeOf(bounds);
  const int64_t width = int64_t{cells.x()} * pixels, height = int64_t{cells.y()} * pixels;
  if (width > kMostPixels / height) {
    throw std::runtime_error("the picture would have " + std::to_string(width) + " x " +
                             std::to_string(height) +
                             " pixels; lower --pixels, or use larger cells");
  }
  RgbImage image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  const size_t row_bytes = 3 * static_cast<size_t>(image.width);
  for (int64_t i = 0; i < int64_t{image.width} * image.height; ++i) {
    image.values.insert(image.values.end(), kUnknown.begin(), kUnknown.end());
  }
  for (const SliceCell& cell : slice) {
    const Colour colour = cell.state == CellState::kSurface
                              ? kSurface
                              : colourOf(static_cast<double>(cell.distance_m) / most_m);
    const auto left = static_cast<size_t>(cell.cell.x - bounds.min().x()) *
                      static_cast<size_t>(pixels),
               top = static_cast<size_t>(bounds.max().y() - cell.cell.y) *
                     static_cast<size_t>(pixels);
    for (size_t v = top; v < top + static_cast<size_t>(pixels); ++v) {
      for (size_t u = left; u < left + static_cast<size_t>(pixels); ++u) {
        std::copy(colour.begin(), colour.end(),
                  image.values.begin() + static_cast<std::ptrdiff_t>(v * row_bytes + 3 * u));
      }
    }
  }
  return image;
}

double farthest(const std::vector<SliceCell>& slice) {
  double most_m = std::numeric_limits<double>::min();
  for (const SliceCell& cell : slice) {
    most_m = std::max(most_m, static_cast<double>(cell.distance_m));
  }
  return most_m;
}

}  // namespace

void drawSlice(const std::vector<std::string>& arguments) {
  MapToolOptions options;
  double height_m = 0.0;
  int pixels = 4;
  CommandLine line("map_tool slice", "FILE OUT.png --height METRES [options]",
                   "Draws the distances to surfaces at one height, x to the right and y up: red "
                   "near a surface to blue at the largest distance, surfaces black, unknown "
                   "grey.");
  line.addNumber({"--height", "METRES", "height of the slice, along z of the map frame"}, height_m,
                 {-1e4, 1e4});
  line.require("--height");
  line.addNumber({"--pixels", "N", "pixels per edge of a cell"}, pixels, {1, 64});
  parseSpaceOutput(line, arguments, "the picture", ".png", options);
  prepareOutputFile(options.out_path);
  const auto mapper = loadWithSpace(options);
  Space& space = *mapper->space();
  space.updateDistances();
  const std::vector<SliceCell> slice = sliceAt(space, height_m);
  if (slice.empty()) {
    throw std::runtime_error("nothing is known at " + shortestText(height_m) +
                             " m; choose another --height (map_tool info prints the map's bounds)");
  }
  const double most_m = farthest(slice);
  const RgbImage image = draw(slice, most_m, pixels);
  writeFileAtomically(options.out_path, encodeColourPng(image));
  std::printf("%zu known cells of %g m, distances up to %.2f m: %s\n", slice.size(),
              space.cellSize_m(), most_m, options.out_path.c_str());
}

}  // namespace dtsdf
