/// What Python gives and takes: arrays of numpy and settings; what does not fit is refused in
/// words.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf::python {

namespace py = pybind11;

/// Does work while other threads of Python run.
template <class Work>
auto withoutGil(const Work& work) {
  const py::gil_scoped_release release;
  return work();
}

/// An array that shows memory of `owner`, which lives as long as the array. It cannot be written.
template <class T>
py::array viewOf(const T* data, std::vector<py::ssize_t> shape, py::handle owner,
                 std::vector<py::ssize_t> strides = {}) {
  py::array view(py::dtype::of<T>(), std::move(shape), std::move(strides), data, owner);
  view.attr("flags").attr("writeable") = false;
  return view;
}

/// Takes over a vector, without copying it.
template <class T>
py::array takeOver(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
  auto* const kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array(py::dtype::of<T>(), std::move(shape), {}, kept->data(), owner);
}

/// The name of a value's type, for messages.
inline std::string typeName(py::handle value) { return Py_TYPE(value.ptr())->tp_name; }

/// The text of a path, from str, bytes or os.PathLike. @throws py::type_error for other things.
std::string pathOf(const py::object& path);

/// What an array is, for messages: "float64 of shape (480, 640)".
std::string describe(const py::array& array);

/// A depth image without camera and pose, in the memory of the array. `unit_m` 0: 0.001 for uint16,
/// 1 for float32. @throws py::value_error, py::type_error for what is no depth image.
DepthFrame depthImageOf(const py::object& depth, double unit_m);

/// A colour image without camera and pose, in the memory of the array: (H, W, 3) or (H, W, 4) in
/// the order of `encoding`, or (H, W) of grey.
ColourFrame colourImageOf(const py::object& colour, const std::string& encoding);

/// The camera, from a 3 x 3 matrix or from fx, fy, cx, cy. @throws py::value_error
Intrinsics intrinsicsOf(const py::object& camera);
/// The 3 x 3 matrix of a camera.
py::array matrixOf(const Intrinsics& intrinsics);

/// A pose from a 4 x 4 matrix; `name` is for messages.
/// @throws py::value_error unless it is finite, a rotation and a translation.
Eigen::Isometry3d poseOf(const py::object& matrix, const std::string& name);
/// The 4 x 4 matrix of a pose.
py::array matrixOf(const Eigen::Isometry3d& pose);

/// Three finite numbers. @throws py::value_error
Eigen::Vector3d vectorOf(const py::object& vector, const std::string& name);

/// N points, (N, 3), converted to double. @throws py::value_error
py::array_t<double> pointsOf(const py::object& points);

/// A flat tree of what `settings` (None, a dict or a path) and then `keywords` give.
/// @throws py::type_error for other things, std::runtime_error for a file that is not YAML.
ParamTree settingsOf(const pybind11::object& settings, const pybind11::kwargs& keywords);

/// A dict with the keys and values of such a tree.
pybind11::dict dictOf(const ParamTree& tree);

}  // namespace dtsdf::python
