#include "python/values.h"

#include <cmath>
#include <limits>
#include <new>

#include "dtsdf_mapping/io/yaml_params.h"

namespace dtsdf::python {
namespace {

constexpr double kRotationTolerance = 1e-3;

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Numbers as doubles; other things are refused with what is wanted.
Doubles numbersOf(const py::object& values, const std::string& wanted) {
  const py::array array = py::array::ensure(values);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(wanted + "; this is a " + typeName(values));
  }
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u') {
    throw py::type_error(wanted + "; this is " + describe(array));
  }
  const Doubles numbers = Doubles::ensure(array);
  if (numbers) return numbers;
  PyErr_Clear();
  throw std::bad_alloc();
}

[[noreturn]] void refuseShape(const std::string& wanted, const py::array& array) {
  throw py::value_error(wanted + "; this is " + describe(array));
}

void checkFinite(const Doubles& numbers, const std::string& name) {
  for (py::ssize_t i = 0; i < numbers.size(); ++i) {
    if (!std::isfinite(numbers.data()[i])) {
      throw py::value_error(name + " has a number that is not finite (NaN or infinity)");
    }
  }
}

/// An image as it lies in memory. @throws for what is no array, or has pixels apart or reversed.
py::array imageOf(const py::object& image, const std::string& wanted) {
  if (!py::isinstance<py::array>(image)) {
    throw py::type_error(wanted + "; this is a " + typeName(image));
  }
  if (py::hasattr(image, "mask")) {
    throw py::type_error(wanted + "; this is a masked array: pass its filled(0)");
  }
  return py::reinterpret_borrow<py::array>(image);
}

/// Rows one after the other, pixels side by side.
void checkLayout(const py::array& image, const std::string& name) {
  const py::ssize_t pixel =
      image.ndim() == 3 ? image.shape(2) * image.itemsize() : image.itemsize();
  const bool is_dense = image.strides(1) == pixel &&
                        (image.ndim() == 2 || image.strides(2) == image.itemsize()) &&
                        image.strides(0) >= image.shape(1) * pixel;
  const bool is_aligned = image.attr("flags").attr("aligned").cast<bool>();
  if (image.size() > 0 && (!is_dense || !is_aligned)) {
    throw py::value_error(name +
                          " must have its pixels side by side and its rows in order in memory; "
                          "pass numpy.ascontiguousarray(" +
                          name + ")");
  }
}

}  // namespace

std::string pathOf(const py::object& path) {
  const py::object text = py::module::import("os").attr("fspath")(path);
  // Names of files are bytes; Python shows those that are no text in its own way.
  const auto name = py::module::import("os").attr("fsencode")(text).cast<std::string>();
  if (name.find('\0') != std::string::npos)
    throw py::value_error("a path must not contain a NUL character");
  return name;
}

std::string describe(const py::array& array) {
  return py::str(array.dtype()).cast<std::string>() + " of shape " +
         py::str(array.attr("shape")).cast<std::string>();
}

DepthFrame depthImageOf(const py::object& depth, double unit_m) {
  const std::string wanted =
      "depth must be a numpy array of shape (H, W), uint16 (units of unit_m, "
      "0.001 by default) or float32 (metres)";
  const py::array image = imageOf(depth, wanted);
  const bool is_whole = image.dtype().equal(py::dtype::of<uint16_t>());
  if (!is_whole && !image.dtype().equal(py::dtype::of<float>())) {
    throw py::type_error(wanted + "; this is " + describe(image));
  }
  if (image.ndim() != 2) refuseShape(wanted, image);
  checkLayout(image, "depth");
  if (!std::isfinite(unit_m) || unit_m < 0.0) {
    throw py::value_error("unit_m must be above 0: metres per unit of depth");
  }
  DepthFrame frame;
  frame.data = image.data();
  frame.row_bytes = static_cast<size_t>(image.shape(0) > 1 ? image.strides(0)
                                                           : image.shape(1) * image.itemsize());
  frame.width = static_cast<int>(image.shape(1));
  frame.height = static_cast<int>(image.shape(0));
  frame.encoding = is_whole ? DepthEncoding::kUint16 : DepthEncoding::kFloat32;
  frame.unit_m = unit_m > 0.0 ? static_cast<float>(unit_m) : (is_whole ? 0.001f : 1.0f);
  return frame;
}

ColourFrame colourImageOf(const py::object& colour, const std::string& encoding) {
  const std::string wanted =
      "colour must be a numpy array of uint8: (H, W, 3) for rgb8 and bgr8, "
      "(H, W, 4) for rgba8 and bgra8, (H, W) for mono8";
  const std::vector<std::pair<std::string, ColourEncoding>> encodings = {
      {"rgb8", ColourEncoding::kRgb8},
      {"bgr8", ColourEncoding::kBgr8},
      {"rgba8", ColourEncoding::kRgba8},
      {"bgra8", ColourEncoding::kBgra8},
      {"mono8", ColourEncoding::kMono8}};
  const py::array image = imageOf(colour, wanted);
  if (!image.dtype().equal(py::dtype::of<uint8_t>())) {
    throw py::type_error(wanted + "; this is " + describe(image));
  }
  if (image.ndim() != 2 && image.ndim() != 3) refuseShape(wanted, image);
  const py::ssize_t channels = image.ndim() == 2 ? 1 : image.shape(2);
  std::string name = encoding;
  if (name.empty()) name = channels == 1 ? "mono8" : channels == 4 ? "rgba8" : "rgb8";
  for (const auto& [known, value] : encodings) {
    if (known != name) continue;
    const py::ssize_t wants = known == "mono8" ? 1 : known.size() == 5 ? 4 : 3;
    if (channels != wants || (wants == 1 && image.ndim() != 2)) refuseShape(wanted, image);
    checkLayout(image, "colour");
    ColourFrame frame;
    frame.data = image.data();
    frame.row_bytes =
        static_cast<size_t>(image.shape(0) > 1 ? image.strides(0) : image.shape(1) * channels);
    frame.width = static_cast<int>(image.shape(1));
    frame.height = static_cast<int>(image.shape(0));
    frame.encoding = value;
    return frame;
  }
  throw py::value_error("encoding must be rgb8, bgr8, rgba8, bgra8 or mono8, not " + name);
}

Intrinsics intrinsicsOf(const py::object& camera) {
  const std::string wanted =
      "K must be the camera's 3 x 3 matrix [[fx, 0, cx], [0, fy, cy], "
      "[0, 0, 1]], or (fx, fy, cx, cy), in pixels";
  const Doubles k = numbersOf(camera, wanted);
  double fx, fy, cx, cy;
  if (k.ndim() == 1 && k.shape(0) == 4) {
    fx = k.at(0), fy = k.at(1), cx = k.at(2), cy = k.at(3);
  } else if (k.ndim() == 2 && k.shape(0) == 3 && k.shape(1) == 3) {
    fx = k.at(0, 0), fy = k.at(1, 1), cx = k.at(0, 2), cy = k.at(1, 2);
    if (k.at(0, 1) != 0.0 || k.at(1, 0) != 0.0 || k.at(2, 0) != 0.0 || k.at(2, 1) != 0.0 ||
        k.at(2, 2) != 1.0) {
      throw py::value_error(wanted +
                            "; this matrix has skew, or another last row: rectify the image");
    }
  } else {
    refuseShape(wanted, k);
  }
  checkFinite(k, "K");
  if (fx <= 0.0 || fy <= 0.0) {
    throw py::value_error("the focal lengths of K must be above 0, in pixels");
  }
  return {static_cast<float>(fx), static_cast<float>(fy), static_cast<float>(cx),
          static_cast<float>(cy)};
}

py::array matrixOf(const Intrinsics& intrinsics) {
  py::array_t<double> matrix({3, 3});
  const double numbers[9] = {
      intrinsics.fx, 0, intrinsics.cx, 0, intrinsics.fy, intrinsics.cy, 0, 0, 1};
  std::copy(numbers, numbers + 9, matrix.mutable_data());
  return std::move(matrix);
}

Eigen::Isometry3d poseOf(const py::object& matrix, const std::string& name) {
  const std::string wanted =
      name + " must be a 4 x 4 matrix: a rotation and a translation in metres";
  const Doubles numbers = numbersOf(matrix, wanted);
  if (numbers.ndim() != 2 || numbers.shape(0) != 4 || numbers.shape(1) != 4) {
    refuseShape(wanted, numbers);
  }
  checkFinite(numbers, name);
  Eigen::Isometry3d pose;
  pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  const Eigen::Matrix3d rotation = pose.linear();
  const bool is_rotation =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <
          kRotationTolerance &&
      rotation.determinant() > 0.0;
  const bool has_last_row = pose.matrix().row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0);
  if (!is_rotation || !has_last_row) {
    throw py::value_error(wanted + (has_last_row ? "; its upper left 3 x 3 part is not a rotation"
                                                 : "; its last row is not 0 0 0 1"));
  }
  return pose;
}

py::array matrixOf(const Eigen::Isometry3d& pose) {
  py::array_t<double> matrix({4, 4});
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(matrix.mutable_data()) = pose.matrix();
  return std::move(matrix);
}

Eigen::Vector3d vectorOf(const py::object& vector, const std::string& name) {
  const std::string wanted = name + " must be three numbers x, y, z in metres";
  const Doubles numbers = numbersOf(vector, wanted);
  if (numbers.ndim() != 1 || numbers.shape(0) != 3) refuseShape(wanted, numbers);
  checkFinite(numbers, name);
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

py::array_t<double> pointsOf(const py::object& points) {
  const std::string wanted =
      "points_W must be an array of shape (N, 3): x, y, z in the map frame, "
      "in metres";
  const Doubles numbers = numbersOf(points, wanted);
  if (numbers.ndim() != 2 || numbers.shape(1) != 3) refuseShape(wanted, numbers);
  return numbers;
}

namespace {

namespace py = pybind11;

[[noreturn]] void refuseValue(const std::string& key, py::handle value) {
  throw py::type_error("the setting " + key + " must be a number, a bool or a string, not a " +
                       typeName(value));
}

int wholeNumberOf(const std::string& key, py::handle value) {
  int is_beyond = 0;
  const long long number = PyLong_AsLongLongAndOverflow(value.ptr(), &is_beyond);
  if (is_beyond != 0 || number < std::numeric_limits<int>::min() ||
      number > std::numeric_limits<int>::max()) {
    throw py::value_error("the setting " + key + " is out of range");
  }
  return static_cast<int>(number);
}

ParamValue valueOf(const std::string& key, py::handle value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>();
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (typeName(value).rfind("numpy.bool", 0) == 0) return PyObject_IsTrue(value.ptr()) == 1;
  if (PyIndex_Check(value.ptr())) {
    const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
    if (!index) throw py::error_already_set();
    return wholeNumberOf(key, index);
  }
  if (PyNumber_Check(value.ptr())) {
    const double number = PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() == nullptr) return number;
    PyErr_Clear();
  }
  refuseValue(key, value);
}

void addDict(const py::dict& settings, const std::string& section, ParamTree& tree) {
  for (const auto& [name, value] : settings) {
    if (!py::isinstance<py::str>(name)) {
      throw py::type_error("the keys of settings must be strings such as \"map/voxel_size_m\"");
    }
    const std::string key = section + name.cast<std::string>();
    constexpr std::ptrdiff_t kDeepest = 10;  // deeper than any setting: a dict that holds itself
    if (std::count(section.begin(), section.end(), '/') > kDeepest) {
      throw py::value_error("dicts of settings are nested more than 10 deep");
    }
    if (py::isinstance<py::dict>(value)) {
      addDict(py::reinterpret_borrow<py::dict>(value), key + "/", tree);
    } else {
      tree[key] = valueOf(key, value);
    }
  }
}

}  // namespace

ParamTree settingsOf(const py::object& settings, const py::kwargs& keywords) {
  ParamTree tree;
  if (py::isinstance<py::dict>(settings)) {
    addDict(settings, "", tree);
  } else if (!settings.is_none()) {
    if (!py::isinstance<py::str>(settings) && !py::hasattr(settings, "__fspath__")) {
      throw py::type_error("settings must be a dict or the path of a YAML file, not a " +
                           typeName(settings));
    }
    tree = loadYamlParams(pathOf(settings));
  }
  addDict(keywords, "", tree);
  return tree;
}

py::dict dictOf(const ParamTree& tree) {
  py::dict result;
  for (const auto& [key, value] : tree) {
    result[py::str(key)] =
        std::visit([](const auto& v) -> py::object { return py::cast(v); }, value);
  }
  return result;
}

}  // namespace dtsdf::python
