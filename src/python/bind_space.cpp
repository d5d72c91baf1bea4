#include "python/mapper_session.h"
#include "python/module.h"
#include "python/values.h"

namespace dtsdf::python {
namespace {

using Points = Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>;

/// Calls `ask` with the free-space grid and each of N points, without holding the GIL.
template <class Ask>
void askAt(const SpaceView& view, const Points& points_W, const Ask& ask) {
  const py::gil_scoped_release release;
  view.session->withSpace([&](Space& space) {
    for (Eigen::Index i = 0; i < points_W.rows(); ++i) {
      ask(space, static_cast<size_t>(i), Eigen::Vector3d(points_W.row(i)));
    }
  });
}

py::tuple query(const SpaceView& view, const Points& points_W) {
  const py::ssize_t rows = points_W.rows();
  const auto count = static_cast<size_t>(rows);
  std::vector<float> distance_m(count), gradient(3 * count);
  std::vector<uint8_t> known(count);
  askAt(view, points_W, [&](const Space& space, size_t i, const Eigen::Vector3d& p_W) {
    const SpaceDistance at = space.distanceAt(p_W);
    known[i] = at.known ? 1 : 0;
    distance_m[i] = at.distance_m;
    gradient[3 * i] = at.gradient.x;
    gradient[3 * i + 1] = at.gradient.y;
    gradient[3 * i + 2] = at.gradient.z;
  });
  return py::make_tuple(takeOver(std::move(known), {rows}).attr("view")("bool"),
                        takeOver(std::move(distance_m), {rows}),
                        takeOver(std::move(gradient), {rows, 3}));
}

py::array states(const SpaceView& view, const Points& points_W) {
  std::vector<uint8_t> state(static_cast<size_t>(points_W.rows()));
  askAt(view, points_W, [&](const Space& space, size_t i, const Eigen::Vector3d& p_W) {
    // distanceAt() checks that the point is in the range of map coordinates, as cellAt() requires.
    state[i] = space.distanceAt(p_W).known ? static_cast<uint8_t>(space.stateOf(space.cellAt(p_W)))
                                           : uint8_t{0};
  });
  return takeOver(std::move(state), {points_W.rows()});
}

py::tuple cells(const SpaceView& view) {
  std::vector<int32_t> at;
  std::vector<uint8_t> state;
  {
    const py::gil_scoped_release release;
    view.session->withSpace([&](Space& space) {
      for (const SpaceCell& cell : space.cells()) {
        at.insert(at.end(), {cell.cell.x, cell.cell.y, cell.cell.z});
        state.push_back(static_cast<uint8_t>(cell.state));
      }
    });
  }
  const auto count = static_cast<py::ssize_t>(state.size());
  return py::make_tuple(takeOver(std::move(at), {count, 3}), takeOver(std::move(state), {count}));
}

double cellSize(const SpaceView& view) {
  double size_m = 0.0;
  const py::gil_scoped_release release;
  view.session->withSpace([&](Space& space) { size_m = space.cellSize_m(); });
  return size_m;
}

void update(const SpaceView& view) {
  const py::gil_scoped_release release;
  view.session->updateSpace();
}

}  // namespace

void bindSpace(py::module& m) {
  py::class_<SpaceView> space(m, "Space",
                              "The free-space grid of a map. Surface cells are as of the last\n"
                              "mesh() or update(), distances as of the last update(). Points are\n"
                              "(N, 3), x, y, z in the map frame W, in metres; points that are not\n"
                              "finite are unknown.");
  space.def_property_readonly("cell_size_m", &cellSize, "Edge of a cell, in metres.")
      .def("update", &update,
           "Brings surfaces and distances up to date with the integrated images.")
      .def("states", &states, py::arg("points_W"),
           "(N,) uint8: 0 unknown, 1 free (an image showed the whole cell empty), 2 surface.")
      .def("query", &query, py::arg("points_W"),
           "(known, distance_m, gradient): (N,) bool, (N,) float32, (N, 3) float32. Distance to\n"
           "the nearest surface in metres, at most space/max_distance_m, rounded up to whole\n"
           "cells; negative where not known. The gradient, in W, points away from the surface\n"
           "at known points, and towards it elsewhere.")
      .def("cells", &cells,
           "(cells, states) of all free and surface cells: (N, 3) int32 and (N,) uint8. A cell\n"
           "extends from cell to cell + 1, times cell_size_m, in W.");
  refusePickle(space, "Space", "save() its mapper, and load the map in the other process");
}

}  // namespace dtsdf::python
