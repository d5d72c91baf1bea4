// map_tool texture: saves the mesh of a map with textures from a recording's images.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>
#include <utility>
#include <variant>

#include "backend/frame_check.h"
#include "backend/rule_settings.h"
#include "dtsdf_mapping/io/mesh_file.h"
#include "io/atomic_file.h"
#include "io/colour_codes.h"
#include "io/textured_mesh.h"
#include "journal/replay.h"
#include "kernels/colour/colour_image.h"
#include "kernels/colour/exposure.h"
#include "program/progress_bar.h"
#include "program/run_program.h"
#include "tools/map_tool.h"
#include "tools/recorded_input.h"

namespace dtsdf {
namespace {

/// Place of a triangle in a texture: one half of a square of texels. Two triangles share a square,
/// with a border between them for bilinear interpolation.
struct Chart {
  int32_t x, y, side;  ///< The square.
  bool is_second;      ///< Whether the triangle is in the half that contains the last texel.
};

constexpr int32_t kBorder = 3, kMaxTexels = 253, kPageSide = 4096;

/// Length, in texels, of the triangle's two edges at corner 0.
int32_t texelsAlong(const Chart& chart) { return chart.side - kBorder; }

/// A texture page.
struct Page {
  size_t begin, end;  ///< Range of its triangles.
  int32_t height = 0;
};

/// The sum of weights, and the weighted sums of red, green and blue.
using Texel = std::array<float, 4>;

void addTo(Texel& texel, float weight, const Rgb& rgb) {
  texel[0] += weight;
  texel[1] += weight * rgb.red;
  texel[2] += weight * rgb.green;
  texel[3] += weight * rgb.blue;
}

int32_t sideOf(const Mesh& mesh, size_t triangle, double texel_m) {
  const auto& corners = mesh.triangles[triangle];
  float longest_m = 0.0f;
  for (size_t i = 0; i < 3; ++i) {
    longest_m = std::max(longest_m,
                         norm(mesh.vertices_m[corners[i]] - mesh.vertices_m[corners[(i + 1) % 3]]));
  }
  const double texels = std::ceil(static_cast<double>(longest_m) / texel_m);
  return kBorder + static_cast<int32_t>(std::clamp<double>(texels, 1.0, kMaxTexels));
}

/// The mesh of a map, its charts and pages.
class Atlas {
 public:
  Atlas(Mesh mesh, double texel_m) : mesh_(std::move(mesh)) {
    std::vector<int32_t> sides;
    for (size_t i = 0; i < mesh_.triangles.size(); ++i) {
      sides.push_back(sideOf(mesh_, i, texel_m));
    }
    charts_.resize(sides.size());
    constexpr int64_t kMaxFill = int64_t{kPageSide} * kPageSide * 7 / 8;  // rows leave gaps
    for (size_t begin = 0; begin < sides.size();) {
      size_t end = begin;
      for (int64_t halves = 0; end < sides.size() && halves / 2 < kMaxFill; ++end) {
        halves += int64_t{sides[end]} * sides[end];
      }
      addPage(begin, end, sides);
      begin = end;
    }
  }

  const Mesh& mesh() const { return mesh_; }
  const std::vector<Page>& pages() const { return pages_; }

  /// Texture coordinates of each triangle's corners.
  std::vector<std::array<TexturePlace, 3>> places() const {
    std::vector<std::array<TexturePlace, 3>> places;
    for (const Page& page : pages_) {
      for (size_t i = page.begin; i < page.end; ++i) {
        const Chart& chart = charts_[i];
        const auto along = static_cast<float>(texelsAlong(chart));
        const auto place = [&](float s, float t) -> TexturePlace {
          const auto side = static_cast<float>(chart.side);
          const float u = chart.is_second ? side - 0.5f - s : 0.5f + s;
          const float v = chart.is_second ? side - 0.5f - t : 0.5f + t;
          return {(static_cast<float>(chart.x) + u) / kPageSide,
                  (static_cast<float>(chart.y) + v) / static_cast<float>(page.height)};
        };
        places.push_back({place(0.0f, 0.0f), place(along, 0.0f), place(0.0f, along)});
      }
    }
    return places;
  }

  /// Calls visit(texel, s, t) for the texels of a triangle, and for those of the border along its
  /// edge from corner 1 to corner 2. `texel` is the index of a texel in its page. The texel lies at
  /// corner 0 plus s times the edge to corner 1 plus t times the edge to corner 2.
  template <class Visit>
  void visitTexels(size_t triangle, const Visit& visit) const {
    const Chart& chart = charts_[triangle];
    const float step = 1.0f / static_cast<float>(texelsAlong(chart));
    const int32_t last = chart.side - 1;
    for (int32_t j = 0; j <= last; ++j) {
      for (int32_t i = 0; i + j <= last - (chart.is_second ? 1 : 0); ++i) {
        const int32_t x = chart.x + (chart.is_second ? last - i : i);
        const int32_t y = chart.y + (chart.is_second ? last - j : j);
        visit(static_cast<size_t>(y) * kPageSide + static_cast<size_t>(x),
              step * static_cast<float>(i), step * static_cast<float>(j));
      }
    }
  }

 private:
  /// Packs squares into rows, largest first. If two triangles that share a square differ in size,
  /// the smaller one gets more texels than it needs.
  void addPage(size_t begin, size_t end, const std::vector<int32_t>& sides) {
    std::vector<size_t> order(end - begin);
    std::iota(order.begin(), order.end(), begin);
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return sides[a] > sides[b]; });
    int32_t x = 0, y = 0, row = sides[order[0]];
    for (size_t i = 0; i < order.size(); ++i) {
      const int32_t side = sides[order[i]];
      if (i > 0 && i % 2 == 1) {
        charts_[order[i]] = charts_[order[i - 1]];
        charts_[order[i]].is_second = true;
        continue;
      }
      if (x + side > kPageSide) {
        x = 0;
        y += std::exchange(row, side);
      }
      charts_[order[i]] = {x, y, side, false};
      x += side;
    }
    pages_.push_back({begin, end, y + row});
  }

  const Mesh mesh_;
  std::vector<Chart> charts_;
  std::vector<Page> pages_;
};

/// An image, and the map rendered from its pose.
class SeenImage {
 public:
  /// @param before In: exposure of the previous image. Out: exposure of this image.
  SeenImage(const ColourFrame& frame, Mapper& mapper, const PaintSettings& settings,
            float voxel_size_m, Exposure& before)
      : frame_(frame),
        rules_(settings.rules),
        voxel_size_m_(voxel_size_m),
        view_(mapper.render({frame.width, frame.height, frame.intrinsics}, frame.T_W_C)) {
    takePixels();
    before = exposure_ = exposureOf(sumsWithMap(), before, settings);
  }

  /// Adds the image's colours to the texels of a triangle with these corners and normals.
  void paint(const Atlas& atlas, size_t triangle, const std::array<Vec3f, 3>& p_C,
             const std::array<Vec3f, 3>& n_C, float texel_m, std::vector<Texel>& texels) const {
    const Intrinsics& K = frame_.intrinsics;
    bool may_see = false;
    for (size_t i = 0; i < 3; ++i) {
      if (p_C[i].z < kMinDepth_m) return;
      const float u = K.fx * p_C[i].x / p_C[i].z + K.cx, v = K.fy * p_C[i].y / p_C[i].z + K.cy;
      may_see |= u > 0.0f && v > 0.0f && u < static_cast<float>(view_.width) &&
                 v < static_cast<float>(view_.height) && dot(n_C[i], p_C[i]) < 0.0f;
    }
    if (!may_see) return;
    const Vec3f p_1 = p_C[1] - p_C[0], p_2 = p_C[2] - p_C[0];
    const Vec3f n_1 = n_C[1] - n_C[0], n_2 = n_C[2] - n_C[0];
    atlas.visitTexels(triangle, [&](size_t texel, float s, float t) {
      const Vec3f p = p_C[0] + s * p_1 + t * p_2;
      const Vec3f n = n_C[0] + s * n_1 + t * n_2;
      const float facing = -dot(n, p) / (norm(n) * norm(p));
      const float u = K.fx * p.x / p.z + K.cx, v = K.fy * p.y / p.z + K.cy;
      if (!(facing > 0.0f && p.z > kMinDepth_m && u >= 1.0f && v >= 1.0f &&
            u < static_cast<float>(view_.width) - 2.0f &&
            v < static_cast<float>(view_.height) - 2.0f)) {
        return;
      }
      if (isHidden(u, v, p.z)) return;
      const Rgb rgb = colourAt(image_, levelOfWidth(K.fx * texel_m / p.z), u + 0.5f, v + 0.5f);
      addTo(texels[texel], quality(facing, p.z),
            {minimum(rgb.red * exposure_.gain[0], 255.0f),
             minimum(rgb.green * exposure_.gain[1], 255.0f),
             minimum(rgb.blue * exposure_.gain[2], 255.0f)});
    });
  }

 private:
  static constexpr float kMinDepth_m = 0.05f;
  /// Weight of a view. The best views dominate; weights change gradually, so there are no seams.
  static float quality(float facing, float depth_m) {
    const float share = facing / (depth_m * depth_m);
    return share * share;
  }

  void takePixels() {
    const PixelLayout layout = layoutOf(frame_.encoding);
    image_ = layOut(nullptr, frame_.width, frame_.height);
    pixels_.resize(static_cast<size_t>(pixelCount(image_)));
    image_.pixels = pixels_.data();
    ColourPixel* to = pixels_.data();
    for (int v = 0; v < frame_.height; ++v) {
      const auto* const row =
          static_cast<const uint8_t*>(frame_.data) + static_cast<size_t>(v) * frame_.row_bytes;
      for (int u = 0; u < frame_.width; ++u) *to++ = takePixel(row + u * layout.bytes, layout);
    }
    for (int level = 1; level < kColourLevels; ++level) {
      for (int v = 0; v < image_.level[level].height; ++v) {
        for (int u = 0; u < image_.level[level].width; ++u) {
          *to++ = halvedPixel(image_, level, u, v);
        }
      }
    }
  }

  bool isHidden(float u, float v, float depth_m) const {
    const size_t pixel = static_cast<size_t>(v + 0.5f) * static_cast<size_t>(view_.width) +
                         static_cast<size_t>(u + 0.5f);
    const float seen_m = view_.depth_m[pixel];
    return seen_m > 0.0f && depth_m > seen_m + rules_.hidden_depth * voxel_size_m_;
  }

  /// Sums over the pixels of painted surfaces where both the image and the map are well exposed.
  ExposureSums sumsWithMap() const {
    ExposureSums sums{};
    for (size_t i = 0; i < view_.colours.size(); ++i) {
      const VertexColour& map = view_.colours[i];
      const VoxelColour of_map{map.red, map.green, map.blue, 0};
      const VoxelColour of_image{pixels_[i].red, pixels_[i].green, pixels_[i].blue, 0};
      if (map.painted != 0 && isWellExposed(of_map) && isWellExposed(of_image)) {
        addToSums(sums, of_map, of_image);
      }
    }
    return sums;
  }

  const ColourFrame& frame_;
  const ColourRules& rules_;
  const float voxel_size_m_;
  const RenderedView view_;
  std::vector<ColourPixel> pixels_;
  ColourImage image_;
  Exposure exposure_;
};

/// Calls `take` for each colour image of a recording or a journal (the node's record of its input).
/// @param what Label of the progress bar. @param T_W_M Levelling transform of the map; not used for
/// journals.
void visitImages(const RunOptions& options, const std::optional<Eigen::Isometry3d>& T_W_M,
                 const std::string& what, const std::function<void(const ColourFrame&)>& take) {
  size_t count = 0;
  if (options.recording.format == "journal") {
    JournalReplay journal(options.recording.path);
    if (!options.recording.poses_path.empty()) {
      journal.correctGiven(
          readTrajectory(options.recording.poses_path, "expected a file with poses").poses());
    }
    ProgressBar progress(what, std::nullopt);
    while (const std::optional<journal::Call> call = journal.next()) {
      const auto* const image = std::get_if<journal::Image>(&*call);
      if (image == nullptr || !std::holds_alternative<ColourFrame>(image->frame)) continue;
      take(std::get<ColourFrame>(image->frame));
      progress.show(++count);
    }
    return;
  }
  const NodeParams params =
      readSettings(options, {{"colour/enabled", std::string("always")}}).params;
  const auto source = levelled(openColours(options, params), T_W_M);
  ProgressBar progress(what, source->size());
  while (const std::optional<SourceColour> image = source->next()) {
    take(image->colour);
    progress.show(++count);
  }
}

/// The initial texels of a page: the map's colours, or grey, at a negligible weight. These
/// colours remain only in texels that are not visible in any image.
std::vector<Texel> beginPage(const Atlas& atlas, const Page& page) {
  constexpr float kTinyWeight = 1e-30f;
  std::vector<Texel> texels(static_cast<size_t>(page.height) * kPageSide, Texel{});
  const Mesh& mesh = atlas.mesh();
  for (size_t i = page.begin; i < page.end; ++i) {
    std::array<Rgb, 3> rgb{};
    for (size_t corner = 0; corner < 3; ++corner) {
      const auto colour = vertexColour(MeshColour::kImage, mesh, mesh.triangles[i][corner]);
      rgb[corner] = {static_cast<float>(colour[0]), static_cast<float>(colour[1]),
                     static_cast<float>(colour[2])};
    }
    atlas.visitTexels(i, [&](size_t texel, float s, float t) {
      const float rest = std::clamp(1.0f - s - t, 0.0f, 1.0f), sum = rest + s + t;
      addTo(texels[texel], kTinyWeight * rest / sum, rgb[0]);
      addTo(texels[texel], kTinyWeight * s / sum, rgb[1]);
      addTo(texels[texel], kTinyWeight * t / sum, rgb[2]);
    });
  }
  return texels;
}

std::string pngOf(const std::vector<Texel>& texels, int32_t height) {
  RgbImage image{kPageSide, height, {}};
  image.values.reserve(3 * texels.size());
  for (const Texel& texel : texels) {
    const float scale = texel[0] > 0.0f ? 1.0f / texel[0] : 0.0f;
    for (const float sum : {texel[1], texel[2], texel[3]}) {
      image.values.push_back(static_cast<uint8_t>(std::min(scale * sum + 0.5f, 255.0f)));
    }
  }
  return encodeColourPng(image);
}

/// Paints a page with all images, one by one. @param painted Increased by the number of texels that
/// are visible in an image. @return the page as PNG.
template <class VisitImages>
std::string paintPage(const Atlas& atlas, const Page& page, const VisitImages& visit_images,
                      const RunSettings& settings, float texel_m, Mapper& mapper, size_t& painted) {
  std::vector<Texel> texels = beginPage(atlas, page);
  const PaintSettings paint = makePaintSettings(settings.params.mapper, settings.rules);
  const Mesh& mesh = atlas.mesh();
  Exposure exposure = sameExposure();
  visit_images([&](const ColourFrame& frame) {
    if (findProblem(frame, settings.params.mapper)) return;
    const SeenImage image(frame, mapper, paint, settings.params.mapper.map.voxel_size_m, exposure);
    const Eigen::Isometry3d T_C_W = frame.T_W_C.inverse();
    const Eigen::Matrix3f R = T_C_W.linear().cast<float>();
    const Eigen::Vector3f t = (T_C_W * Eigen::Vector3d(mesh.origin_m.data())).cast<float>();
    const auto turned = [&](const Vec3f& a, const Eigen::Vector3f& moved) -> Vec3f {
      const Eigen::Vector3f b = R * Eigen::Vector3f(a.x, a.y, a.z) + moved;
      return {b.x(), b.y(), b.z()};
    };
    for (size_t i = page.begin; i < page.end; ++i) {
      std::array<Vec3f, 3> p_C{}, n_C{};
      for (size_t corner = 0; corner < 3; ++corner) {
        p_C[corner] = turned(mesh.vertices_m[mesh.triangles[i][corner]], t);
        n_C[corner] = turned(mesh.normals[mesh.triangles[i][corner]], Eigen::Vector3f::Zero());
      }
      image.paint(atlas, i, p_C, n_C, texel_m, texels);
    }
  });
  constexpr float kMinOfImage = 1e-20f;
  painted += static_cast<size_t>(std::count_if(
      texels.begin(), texels.end(), [](const Texel& of) { return of[0] > kMinOfImage; }));
  return pngOf(texels, page.height);
}

}  // namespace

void textureMap(const std::vector<std::string>& arguments) {
  MapToolOptions options;
  RunOptions input;
  std::optional<double> texel_m;
  CommandLine line("map_tool texture", "RECORDING MAP --mesh OUT [options]",
                   "Saves the mesh of a map with textures from the colour images of a recording or "
                   "a journal.");
  line.addText({"RECORDING", "", "a folder, a bag or a journal, as for reconstruct"},
               input.recording.path);
  line.addText({"MAP", "", "the map file built from the recording"}, options.map_path);
  line.addText({"--mesh", "OUT", "the mesh: .obj, with .mtl and .png next to it, or .glb"},
               options.out_path);
  line.require("--mesh");
  line.addNumber({"--texel", "METRES", "edge of a texel (default: a sixth of a voxel)"}, texel_m,
                 {1e-4, 1.0});
  addSettings(line, "mesh/..., colour/exposure, backend, threads", options);
  addFormatOption(line, input);
  addReadingOptions(line, input);
  addFrameOptions(line, input);
  line.parse(arguments);
  const std::string format = meshFormatOf(options.out_path);
  if (format != ".obj" && format != ".glb") {
    throw UsageError("'" + options.out_path + "' does not end in .obj or .glb");
  }
  prepareOutputFile(options.out_path);
  completeInput(input);
  const std::optional<Eigen::Isometry3d> T_W_M = readMapInfo(options.map_path).T_W_M;
  const auto [settings, mapper] = loadMapOf(options, "space/enabled=false");
  const float voxel_size_m = settings.params.mapper.map.voxel_size_m;
  const double edge_m = texel_m.value_or(static_cast<double>(voxel_size_m) / 6.0);
  const Atlas atlas(meshOf(*mapper, voxel_size_m), edge_m);
  TexturedMesh textured{atlas.mesh(), atlas.places(), {}, {}};
  size_t bytes = 0, painted = 0;
  for (const Page& page : atlas.pages()) {
    const std::string what = "images, page " + std::to_string(textured.pages.size() + 1) + " of " +
                             std::to_string(atlas.pages().size());
    textured.page_triangles.push_back(page.end - page.begin);
    textured.pages.push_back(paintPage(
        atlas, page, [&](const auto& take) { visitImages(input, T_W_M, what, take); }, settings,
        static_cast<float>(edge_m), *mapper, painted));
    bytes += textured.pages.back().size();
  }
  if (painted == 0) {
    throw std::runtime_error(
        "the map is not visible in any image; give the recording and --poses used to build it");
  }
  saveTexturedMesh(textured, options.out_path);
  std::printf("%zu triangles, %zu textures of %d texels across, %.1f MB: %s\n",
              textured.mesh.triangles.size(), textured.pages.size(), kPageSide,
              static_cast<double>(bytes) / 1e6, options.out_path.c_str());
}

}  // namespace dtsdf
