/// Converts numpy arrays and settings from and to Python. Errors say what is wrong with a value.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf::python {

namespace py = pybind11;

/// Runs `work` without holding the GIL.
template <class Work>
auto withoutGil(const Work& work) {
  const py::gil_scoped_release release;
  return work();
}

/// A read-only array that uses the memory of `owner` and keeps it alive.
template <class T>
py::array viewOf(const T* data, std::vector<py::ssize_t> shape, py::handle owner,
                 std::vector<py::ssize_t> strides = {}) {
  py::array view(py::dtype::of<T>(), std::move(shape), std::move(strides), data, owner);
  view.attr("flags").attr("writeable") = false;
  return view;
}

/// Moves a vector into an array, without copying. @tparam T Type of the array's elements, if
/// different.
template <class T = void, class Value>
py::array takeOver(std::vector<Value>&& values, std::vector<py::ssize_t> shape) {
  using Number = std::conditional_t<std::is_void_v<T>, Value, T>;
  auto* const kept = new std::vector<Value>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<Value>*>(p); });
  return py::array(py::dtype::of<Number>(), std::move(shape), {},
                   reinterpret_cast<const Number*>(kept->data()), owner);
}

/// Converts str, bytes or os.PathLike to a file name. @throws py::type_error for other types.
std::string pathOf(const py::object& path);

/// A depth image without camera and pose, which uses the memory of the array. A `unit_m` of 0
/// stands for 0.001 (uint16) or 1 (float32). @throws py::value_error, py::type_error if it is not a
/// depth image.
DepthFrame depthImageOf(const py::array& depth, double unit_m);

/// The names of the ColourEncoding values, in the same order.
constexpr const char* kEncodings[] = {"rgb8", "bgr8", "rgba8", "bgra8", "mono8"};

/// A colour image without camera and pose, which uses the memory of the array: (H, W, 3), (H, W, 4)
/// or (H, W). If `encoding` is empty, it is chosen by shape. @throws as depthImageOf()
ColourFrame colourImageOf(const py::array& colour, const std::string& encoding);

/// Matrices in numpy's layout.
using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// The camera, from a 3 x 3 matrix or from fx, fy, cx, cy. @throws py::value_error
Intrinsics intrinsicsOf(const Eigen::MatrixXd& K);
/// The 3 x 3 matrix of a camera.
Matrix3 matrixOf(const Intrinsics& intrinsics);

/// A pose; does not check the rotation. @throws py::value_error unless the last row is 0 0 0 1.
Eigen::Isometry3d poseOf(const Matrix4& matrix);

/// The matrix of a pose; none if there is no pose.
inline std::optional<Matrix4> matrixOf(const std::optional<Eigen::Isometry3d>& pose) {
  return pose ? std::optional<Matrix4>(pose->matrix()) : std::nullopt;
}

/// The settings in `settings` (None, a dict or a path) as keys and values, overridden by
/// `keywords`. In files, settings that only the node uses are ignored.
/// @throws py::type_error, py::value_error for other values, std::runtime_error for a file that
/// cannot be read or is not YAML.
ParamTree settingsOf(const py::object& settings, const py::kwargs& keywords);

}  // namespace dtsdf::python
