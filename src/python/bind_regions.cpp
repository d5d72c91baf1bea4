#include "dtsdf_mapping/region.h"
#include "python/arrays.h"
#include "python/module.h"

namespace dtsdf::python {
namespace {

/// @throws py::value_error for a region with a problem.
template <class Shape>
Shape checkedShape(const Shape& shape) {
  const std::string problem = findProblem(shape);
  if (!problem.empty()) throw py::value_error(problem);
  return shape;
}

BoxRegion makeBox(const py::object& size_m, const py::object& T_W_B) {
  BoxRegion box;
  box.size_m = vectorOf(size_m, "size_m");
  if (!T_W_B.is_none()) box.T_W_B = poseOf(T_W_B, "T_W_B");
  return checkedShape(box);
}

SphereRegion makeSphere(const py::object& center_W, double radius_m) {
  SphereRegion sphere;
  sphere.center_W = vectorOf(center_W, "center_W");
  sphere.radius_m = radius_m;
  return checkedShape(sphere);
}

}  // namespace

void bindRegions(py::module& m) {
  py::class_<BoxRegion>(m, "Box", "A box of any orientation in the map frame W, faces included.")
      .def(py::init(&makeBox), py::arg("size_m"), py::arg("T_W_B") = py::none(),
           "size_m: whole extents along the box's axes, (3,), in metres. T_W_B: 4 x 4, from the\n"
           "box, whose middle is 0, to the map frame, in metres; None: axes and origin of W.");
  py::class_<SphereRegion>(m, "Sphere", "A ball in the map frame W, surface included.")
      .def(py::init(&makeSphere), py::arg("center_W"), py::arg("radius_m"),
           "center_W: (3,), and radius_m, in metres.");
}

}  // namespace dtsdf::python
