#include <memory>

#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/mesh.h"
#include "dtsdf_mapping/region.h"
#include "dtsdf_mapping/simplify.h"
#include "python/module.h"
#include "python/values.h"

namespace dtsdf::python {
namespace {

/// @throws py::value_error for an invalid region.
template <class Shape>
Shape checkedShape(const Shape& shape) {
  const std::string problem = findProblem(shape);
  if (!problem.empty()) throw py::value_error(problem);
  return shape;
}

BoxRegion makeBox(const Eigen::Vector3d& size_m, const std::optional<Matrix4>& T_W_B) {
  BoxRegion box;
  box.size_m = size_m;
  if (T_W_B) box.T_W_B = poseOf(*T_W_B);
  return checkedShape(box);
}

SphereRegion makeSphere(const Eigen::Vector3d& center_W, double radius_m) {
  SphereRegion sphere;
  sphere.center_W = center_W;
  sphere.radius_m = radius_m;
  return checkedShape(sphere);
}

}  // namespace

void bindRegions(py::module& m) {
  py::class_<BoxRegion>(m, "Box", "A box of any orientation in the map frame W, faces included.")
      .def(py::init(&makeBox), py::arg("size_m"), py::arg("T_W_B") = py::none(),
           "size_m: edges along the box's axes, (3,), in metres. T_W_B: 4 x 4, from the box's\n"
           "frame, whose origin is its centre, to the map frame, in metres; None: the identity.");
  py::class_<SphereRegion>(m, "Sphere", "A ball in the map frame W, surface included.")
      .def(py::init(&makeSphere), py::arg("center_W"), py::arg("radius_m"),
           "center_W: (3,), and radius_m, in metres.");
}

namespace {

using SharedMesh = std::shared_ptr<const Mesh>;

py::ssize_t rows(size_t count) { return static_cast<py::ssize_t>(count); }

py::array verticesOf(const py::object& self) {
  const auto& mesh = *self.cast<SharedMesh>();
  return viewOf(reinterpret_cast<const float*>(mesh.vertices_m.data()),
                {rows(mesh.vertices_m.size()), 3}, self);
}

py::array normalsOf(const py::object& self) {
  const auto& mesh = *self.cast<SharedMesh>();
  return viewOf(reinterpret_cast<const float*>(mesh.normals.data()), {rows(mesh.normals.size()), 3},
                self);
}

py::array trianglesOf(const py::object& self) {
  const auto& mesh = *self.cast<SharedMesh>();
  return viewOf(reinterpret_cast<const uint32_t*>(mesh.triangles.data()),
                {rows(mesh.triangles.size()), 3}, self);
}

py::object coloursOf(const py::object& self) {
  const auto& mesh = *self.cast<SharedMesh>();
  if (mesh.colours.empty()) return py::none();
  return viewOf(&mesh.colours.data()->red, {rows(mesh.colours.size()), 3}, self,
                {sizeof(VertexColour), 1});
}

py::object paintedOf(const py::object& self) {
  const auto& mesh = *self.cast<SharedMesh>();
  if (mesh.colours.empty()) return py::none();
  py::array_t<bool> painted(rows(mesh.colours.size()));
  for (size_t i = 0; i < mesh.colours.size(); ++i) {
    painted.mutable_data()[i] = mesh.colours[i].painted != 0;
  }
  return std::move(painted);
}

MeshColour colourModeOf(const std::string& name) {
  MeshParams params;
  ParamReader reader({{"mesh/colour", name}});
  visitParams(params, reader);
  reader.finish();
  return params.colour;
}

void save(const SharedMesh& mesh, const py::object& path, const std::string& colour) {
  const MeshColour mode = colourModeOf(colour);
  const std::string name = pathOf(path);
  const py::gil_scoped_release release;
  saveMesh(*mesh, mode, name);
}

/// Lets Python handle signals while simplifying. An exception, as from Ctrl-C, cancels it.
py::tuple simplify(const SharedMesh& mesh, double max_error_m) {
  SimplifiedMesh simplified;
  {
    const py::gil_scoped_release release;
    simplified = simplifyMesh(*mesh, max_error_m, [](double) {
      const py::gil_scoped_acquire acquire;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    });
  }
  return py::make_tuple(std::make_shared<Mesh>(std::move(simplified.mesh)), simplified.error_m);
}

}  // namespace

void bindMesh(py::module& m) {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float) && sizeof(VertexColour) == 4,
                "numpy arrays are views of these structs");
  py::class_<Mesh, std::shared_ptr<Mesh>> mesh(m, "Mesh",
                                               "A triangle mesh in the map frame W, in metres. Its "
                                               "arrays are views of the mesh's memory: they\n"
                                               "are read-only and keep the mesh alive.");
  mesh.def_property_readonly(
          "origin_m",
          [](const SharedMesh& self) { return py::array_t<double>(3, self->origin_m.data()); },
          "(3,) float64: origin of the vertices in W, in metres; 0 unless the\n"
          "mesh extends beyond 64 m from W's origin.")
      .def_property_readonly("vertices", &verticesOf,
                             "(N, 3) float32: positions in W minus origin_m, in metres.")
      .def_property_readonly("normals", &normalsOf,
                             "(N, 3) float32: unit normals in W, pointing towards free space.")
      .def_property_readonly("triangles", &trianglesOf,
                             "(M, 3) uint32: vertex indices, counter-clockwise as seen from\n"
                             "free space.")
      .def_property_readonly("colours", &coloursOf,
                             "(N, 3) uint8: red, green, blue; None if the map was never painted.")
      .def_property_readonly("painted", &paintedOf,
                             "(N,) bool: whether the vertex was painted; None if colours is None.")
      .def("save", &save, py::arg("path"), py::arg("colour") = "auto",
           "Saves as .ply, .obj, .stl or .glb, by extension. colour: auto (image if painted,\n"
           "otherwise normal), image, normal, height or plain. Raises RuntimeError if the mesh is\n"
           "empty or the file cannot be written; an existing file is then kept.")
      .def(
          "simplify", &simplify, py::arg("max_error_m"),
          "Returns (mesh, error_m): a mesh with fewer triangles, and the largest distance of this\n"
          "mesh's vertices from it, at most max_error_m. Raises ValueError for a max_error_m that\n"
          "is not finite, below 0 or above the diagonal of the mesh.")
      .def("__repr__", [](const SharedMesh& self) {
        return "<dtsdf_mapping.Mesh: " + std::to_string(self->vertices_m.size()) + " vertices, " +
               std::to_string(self->triangles.size()) + " triangles>";
      });
  refusePickle(mesh, "Mesh", "save(path) it, or pickle copies of its arrays");
}

}  // namespace dtsdf::python
