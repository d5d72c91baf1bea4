#include "python/values.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "dtsdf_mapping/io/yaml_params.h"
#include "params/node_params.h"

namespace dtsdf::python {
namespace {

/// Describes an array for error texts: "float64 of shape (480, 640)".
std::string describe(const py::array& array) {
  return py::str(array.dtype()).cast<std::string>() + " of shape " +
         py::str(array.attr("shape")).cast<std::string>();
}

/// Checks that rows are in order and pixels are adjacent in memory.
void checkLayout(const py::array& image, const std::string& name) {
  const py::ssize_t pixel =
      image.ndim() == 3 ? image.shape(2) * image.itemsize() : image.itemsize();
  const bool is_dense = image.strides(1) == pixel &&
                        (image.ndim() == 2 || image.strides(2) == image.itemsize()) &&
                        image.strides(0) >= image.shape(1) * pixel;
  const bool is_aligned = image.attr("flags").attr("aligned").cast<bool>();
  if (image.size() > 0 && (!is_dense || !is_aligned)) {
    throw py::value_error(name +
                          " must have its rows in order and its pixels adjacent in memory; "
                          "pass numpy.ascontiguousarray(" +
                          name + ")");
  }
}

/// A frame that refers to the memory of an image with `pixel_bytes` per pixel.
template <class Frame>
Frame frameOf(const py::array& image, py::ssize_t pixel_bytes, const std::string& name) {
  if (py::hasattr(image, "mask")) {
    throw py::type_error(name + " is a masked array; pass its filled(0) instead");
  }
  checkLayout(image, name);
  Frame frame;
  frame.data = image.data();
  frame.row_bytes =
      static_cast<size_t>(image.shape(0) > 1 ? image.strides(0) : image.shape(1) * pixel_bytes);
  frame.width = static_cast<int>(image.shape(1));
  frame.height = static_cast<int>(image.shape(0));
  return frame;
}

/// Reads a dict, nested or flat, by writing it as JSON, which is also YAML.
ParamTree treeOf(const py::dict& settings) {
  using namespace py::literals;
  const py::object of_numpy = py::module::import("numpy").attr("generic").attr("item");
  const py::object text = py::module::import("json").attr("dumps")(
      settings, "ensure_ascii"_a = false, "default"_a = of_numpy);
  try {
    return parseYamlParams(text.cast<std::string>(), "settings");
  } catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
}

}  // namespace

std::string pathOf(const py::object& path) {
  const py::object text = py::module::import("os").attr("fspath")(path);
  // File names are bytes; fsencode() restores names that are not valid UTF-8.
  auto name = py::module::import("os").attr("fsencode")(text).cast<std::string>();
  if (name.find('\0') != std::string::npos)
    throw py::value_error("a path must not contain a NUL character");
  return name;
}

DepthFrame depthImageOf(const py::array& depth, double unit_m) {
  const std::string wanted =
      "depth must be a numpy array of shape (H, W), uint16 (units of unit_m, "
      "0.001 by default) or float32 (metres); this is " +
      describe(depth);
  const bool is_whole = depth.dtype().equal(py::dtype::of<uint16_t>());
  if (!is_whole && !depth.dtype().equal(py::dtype::of<float>())) throw py::type_error(wanted);
  if (depth.ndim() != 2) throw py::value_error(wanted);
  auto frame = frameOf<DepthFrame>(depth, depth.itemsize(), "depth");
  frame.encoding = is_whole ? DepthEncoding::kUint16 : DepthEncoding::kFloat32;
  frame.unit_m = unit_m != 0.0 ? static_cast<float>(unit_m) : (is_whole ? 0.001f : 1.0f);
  return frame;
}

ColourFrame colourImageOf(const py::array& colour, const std::string& encoding) {
  const std::string wanted =
      "colour must be a numpy array of uint8: (H, W, 3) for rgb8 and bgr8, "
      "(H, W, 4) for rgba8 and bgra8, (H, W) for mono8; this is " +
      describe(colour);
  if (!colour.dtype().equal(py::dtype::of<uint8_t>())) throw py::type_error(wanted);
  if (colour.ndim() != 2 && colour.ndim() != 3) throw py::value_error(wanted);
  const py::ssize_t channels = colour.ndim() == 2 ? 1 : colour.shape(2);
  std::string name = encoding;
  if (name.empty()) name = channels == 1 ? "mono8" : channels == 4 ? "rgba8" : "rgb8";
  const auto* const known = std::find(std::begin(kEncodings), std::end(kEncodings), name);
  if (known == std::end(kEncodings)) {
    throw py::value_error("encoding must be rgb8, bgr8, rgba8, bgra8 or mono8, not " + name);
  }
  const py::ssize_t wants = name == "mono8" ? 1 : name.size() == 5 ? 4 : 3;
  if (channels != wants || (wants == 1 && colour.ndim() != 2)) throw py::value_error(wanted);
  auto frame = frameOf<ColourFrame>(colour, channels, "colour");
  frame.encoding = static_cast<ColourEncoding>(known - kEncodings);
  return frame;
}

Intrinsics intrinsicsOf(const Eigen::MatrixXd& K) {
  const bool is_matrix = K.rows() == 3 && K.cols() == 3;
  if (is_matrix || (K.rows() == 4 && K.cols() == 1)) {
    const Eigen::MatrixXf k = K.cast<float>();
    const Intrinsics camera = is_matrix ? Intrinsics{k(0, 0), k(1, 1), k(0, 2), k(1, 2)}
                                        : Intrinsics{k(0), k(1), k(2), k(3)};
    const bool is_plain = !is_matrix || k == matrixOf(camera).cast<float>();
    if (is_plain && k.allFinite() && camera.fx > 0.0f && camera.fy > 0.0f) return camera;
  }
  throw py::value_error(
      "K must be the camera's 3 x 3 matrix [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew, or "
      "(fx, fy, cx, cy), finite, in pixels, with focal lengths above 0");
}

Matrix3 matrixOf(const Intrinsics& intrinsics) {
  Matrix3 matrix;
  matrix << intrinsics.fx, 0, intrinsics.cx, 0, intrinsics.fy, intrinsics.cy, 0, 0, 1;
  return matrix;
}

Eigen::Isometry3d poseOf(const Matrix4& matrix) {
  if (matrix.row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) return Eigen::Isometry3d(matrix);
  throw py::value_error("the last row of a pose must be 0 0 0 1");
}

ParamTree settingsOf(const py::object& settings, const py::kwargs& keywords) {
  ParamTree tree = treeOf(keywords);
  if (py::isinstance<py::dict>(settings)) {
    tree.merge(treeOf(settings));
  } else if (py::isinstance<py::str>(settings) || py::hasattr(settings, "__fspath__")) {
    ParamTree file = loadYamlParams(pathOf(settings));
    const ParamTree of_mapper = toTree(MapperParams());
    for (const auto& [key, value] : toTree(NodeParams())) {
      if (of_mapper.count(key) == 0) file.erase(key);
    }
    tree.merge(file);
  } else if (!settings.is_none()) {
    throw py::type_error("settings must be a dict or the path of a YAML file");
  }
  return tree;
}

}  // namespace dtsdf::python
