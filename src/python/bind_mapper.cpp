#include <pybind11/stl.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "dtsdf_mapping/place_search.h"
#include "python/mapper_session.h"
#include "python/module.h"
#include "python/values.h"

namespace dtsdf::python {
namespace {

/// Calls `action` with the mapper, without holding the GIL, and returns its result.
template <class Action>
auto withMapper(MapperSession& self, const Action& action) {
  return withoutGil([&] { return self.withMapper(action); });
}

using Session = std::shared_ptr<MapperSession>;

/// The settings, including the backend.
ParamTree treeOf(const std::string& backend, const py::object& settings, const py::kwargs& kwargs) {
  ParamTree tree = settingsOf(settings, kwargs);
  if (!backend.empty()) tree["backend"] = backend;
  return tree;
}

Session makeSession(const std::string& backend, const py::object& settings,
                    const py::kwargs& kwargs) {
  const MapperParams params = readMapperParams(treeOf(backend, settings, kwargs));
  const py::gil_scoped_release release;
  return std::make_shared<MapperSession>(params);
}

/// The settings in withSettingsOf() come from the map's file. If they are also passed, their values
/// must be equal.
Session loadSession(const py::object& path, const std::string& backend, const py::object& settings,
                    const py::kwargs& kwargs) {
  const ParamTree given = treeOf(backend, settings, kwargs);
  const MapperParams params = readMapperParams(given);
  const std::string name = pathOf(path);
  const py::gil_scoped_release release;
  const MapContents contents = loadMap(name, params, params.threads);
  ParamTree tree = toTree(withSettingsOf(contents, params));
  for (const auto& [key, value] : given) tree[key] = value;
  const MapperParams bound = readMapperParams(tree);
  checkFits(contents, bound, kLeaveSettingOut);
  return std::make_shared<MapperSession>(bound, contents);
}

/// Raises an exception for wrong arguments; the result reports other problems.
IntegrationResult checked(IntegrationResult result) {
  switch (result.status) {
    case FrameStatus::kBadImage:
    case FrameStatus::kBadIntrinsics:
    case FrameStatus::kBadPose: throw py::value_error(result.message);
    default: return result;
  }
}

IntegrationResult integrate(MapperSession& self, const py::array& depth, const Eigen::MatrixXd& K,
                            const Matrix4& T_W_C, double stamp_s, double unit_m,
                            const std::optional<Eigen::Vector3d>& keep_center_W) {
  DepthFrame frame = depthImageOf(depth, unit_m);
  frame.intrinsics = intrinsicsOf(K);
  frame.T_W_C = poseOf(T_W_C);
  if (!std::isfinite(stamp_s)) throw py::value_error("stamp_s must be a finite number of seconds");
  frame.keep_center_W = keep_center_W;
  return checked(withoutGil([&] { return self.integrate(frame, stamp_s); }));
}

IntegrationResult paint(MapperSession& self, const py::array& colour, const Eigen::MatrixXd& K,
                        const Matrix4& T_W_C, const std::string& encoding) {
  ColourFrame frame = colourImageOf(colour, encoding);
  frame.intrinsics = intrinsicsOf(K);
  frame.T_W_C = poseOf(T_W_C);
  return checked(withMapper(self, [&](Mapper& mapper) { return mapper.paint(frame); }));
}

py::tuple render(MapperSession& self, const Eigen::MatrixXd& K, const Matrix4& T_W_C, int width,
                 int height) {
  const RenderCamera camera{width, height, intrinsicsOf(K)};
  const Eigen::Isometry3d pose = poseOf(T_W_C);
  RenderedView view = withMapper(self, [&](Mapper& mapper) { return mapper.render(camera, pose); });
  py::object colours = py::none();
  if (!view.colours.empty()) {
    colours = takeOver<uint8_t>(std::move(view.colours), {height, width, 4});
  }
  return py::make_tuple(takeOver(std::move(view.depth_m), {height, width}),
                        takeOver<float>(std::move(view.normals_C), {height, width, 3}), colours);
}

py::dict locate(MapperSession& self, const py::array& depth, const Eigen::MatrixXd& K,
                double unit_m) {
  DepthFrame frame = depthImageOf(depth, unit_m);
  frame.intrinsics = intrinsicsOf(K);
  const FoundPlace found = withMapper(
      self, [&](Mapper& mapper) { return findPlace(mapper, frame, self.params().threads); });
  const bool is_found = found.alignment.status == AlignmentStatus::kAligned;
  py::dict result;
  result["T_W_C"] = matrixOf(is_found ? std::optional(found.alignment.T_W_C) : std::nullopt);
  result["status"] = toString(found.alignment.status);
  result["explained"] = found.explained_share;
  result["other_T_W_C"] = matrixOf(found.other_T_W_C);
  return result;
}

py::object mesh(MapperSession& self, const std::optional<BoxRegion>& box) {
  const std::shared_ptr<const Mesh> mesh = withoutGil([&] { return self.mesh(box); });
  return py::cast(std::const_pointer_cast<Mesh>(mesh));  // its arrays are read-only
}

py::dict statsOf(MapperSession& self) {
  const auto [stats, memory] = withMapper(
      self, [](Mapper& mapper) { return std::make_pair(mapper.stats(), mapper.memory()); });
  py::dict result;
  result["blocks"] = stats.blocks;
  result["voxel_arrays"] = stats.voxel_arrays;
  result["map_bytes"] = stats.map_bytes;
  result["max_map_bytes"] = stats.max_map_bytes;
  result["colour_bytes"] = stats.colour_bytes;
  result["free_bytes"] = stats.free_bytes;
  result["refused_blocks"] = stats.refused_blocks;
  result["refused_cubes"] = stats.refused_cubes;
  result["dropped_blocks"] = stats.dropped_blocks;
  result["map_bytes_peak"] = stats.map_bytes_peak;
  result["paged_blocks"] = stats.pages.blocks;
  result["paged_bytes"] = stats.pages.bytes;
  result["lost_blocks"] = stats.pages.lost;
  result["other_bytes"] = memory.spare + memory.indices + memory.meshes + memory.scratch +
                          memory.staging + memory.space;
  return result;
}

py::dict saveSession(MapperSession& self, const py::object& path,
                     const std::optional<std::string>& map_frame) {
  const std::string name = pathOf(path);
  const MapInfo saved = withoutGil([&] { return self.save(name, map_frame); });
  py::dict result;
  result["blocks"] = saved.size.blocks;
  result["file_bytes"] = saved.file_bytes;
  result["content_hash"] = saved.content_hash;
  return result;
}

SpaceView spaceOf(const Session& self) {
  withoutGil([&] { self->withSpace([](Space&) {}); });  // throws if there is no grid
  return {self};
}

void bindResult(py::module& m) {
  py::class_<IntegrationResult>(m, "IntegrationResult", "Result of integrate() or paint().")
      .def_property_readonly(
          "fused", [](const IntegrationResult& self) { return self.status == FrameStatus::kFused; },
          "Whether the frame was fused or painted; if not, the map is unchanged.")
      .def_property_readonly(
          "status", [](const IntegrationResult& self) { return toString(self.status); },
          "\"fused\", or why not: \"no measurement\" or \"no memory\".")
      .def_readonly("message", &IntegrationResult::message,
                    "Why the frame was not fused; or a warning.")
      .def_readonly("refused_blocks", &IntegrationResult::refused_blocks,
                    "Number of blocks, arrays and colour bricks refused for lack of memory\n"
                    "(map/max_memory_mb).")
      .def_readonly("duration_ms", &IntegrationResult::duration_ms, "Wall time, in milliseconds.")
      .def("__bool__",
           [](const IntegrationResult& self) { return self.status == FrameStatus::kFused; })
      .def("__repr__", [](const IntegrationResult& self) {
        const std::string status = toString(self.status);
        return "<dtsdf_mapping.IntegrationResult: " + status +
               (self.message.empty() ? "" : ", " + self.message) + ">";
      });
}

}  // namespace

void bindMapper(py::module& m) {
  bindResult(m);
  py::class_<MapperSession, Session> mapper(
      m, "Mapper",
      "A map: fuses depth images, paints surfaces from colour images, and extracts meshes.\n"
      "Thread-safe: concurrent calls are serialised. Calls release the GIL.");
  mapper
      .def(py::init(&makeSession), py::arg("backend") = "", py::arg("settings") = py::none(),
           "backend: \"auto\" (CUDA where there is a usable GPU), \"cuda\" or \"cpu\".\n"
           "settings: a dict, flat or nested, or the path of a YAML file, in which settings of\n"
           "the node are ignored; keywords override them, as in\n"
           "Mapper(**{\"map/voxel_size_m\": 0.01}). docs/ros.md lists the settings.\n"
           "Raises ValueError, which lists every wrong setting, or RuntimeError if CUDA is\n"
           "requested but cannot be used.")
      .def_static(
          "load", &loadSession, py::arg("path"), py::arg("backend") = "",
          py::arg("settings") = py::none(),
          "Continues a map saved by save() or by the node. Voxel size, truncation, mode and\n"
          "directions are those of the map; its free cells are kept if space/enabled is set.\n"
          "Raises RuntimeError if the file is not a map, or if settings conflict with it.")
      .def("integrate", &integrate, py::arg("depth"), py::arg("K"), py::arg("T_W_C"),
           py::arg("stamp_s") = 0.0, py::arg("unit_m") = 0.0, py::arg("keep_center_W") = py::none(),
           "Fuses a rectified depth image. depth: (H, W), along the optical axis; uint16 in\n"
           "unit_m (0.001 by default), where 0 and 65535 mean no measurement, or float32 in\n"
           "unit_m (1 by default), where NaN, infinity and values up to 0 mean none. K: 3 x 3 or\n"
           "(fx, fy, cx, cy), in pixels. T_W_C: 4 x 4, from the optical frame (x right, y down,\n"
           "z forward) to the map frame, in metres. stamp_s: time of the image, which save()\n"
           "stores. keep_center_W: (3,), centre of map/keep_radius_m, in metres in W.\n"
           "Raises ValueError or TypeError for wrong arguments; the map is then unchanged.")
      .def("paint", &paint, py::arg("colour"), py::arg("K"), py::arg("T_W_C"),
           py::arg("encoding") = "",
           "Paints the surfaces visible in a rectified colour image. colour: uint8, (H, W, 3),\n"
           "(H, W, 4) or (H, W). encoding: rgb8, bgr8, rgba8, bgra8 or mono8; if not given,\n"
           "rgb8, rgba8 or mono8 by shape. K, T_W_C: of the colour camera, as for integrate().")
      .def(
          "render", &render, py::arg("K"), py::arg("T_W_C"), py::arg("width") = 640,
          py::arg("height") = 480,
          "Renders the map from a camera: depth (H, W) in metres, normals (H, W, 3) in the\n"
          "camera's frame, and colours (H, W, 4), red, green, blue and 255 where painted, or None\n"
          "if the map was never painted. 0 where there is no surface. K, T_W_C: as for\n"
          "integrate().")
      .def(
          "locate", &locate, py::arg("depth"), py::arg("K"), py::arg("unit_m") = 0.0,
          "Finds where in the map a depth image was taken, without an initial pose. Takes seconds\n"
          "on a CPU. Returns a dict: T_W_C, 4 x 4 in metres, or None if it was not found; status;\n"
          "explained, the fraction of depths that match the map at the best pose; other_T_W_C,\n"
          "another pose that matches about as well, or None. depth, K, unit_m: as for integrate().")
      .def("mesh", &mesh, py::arg("box") = py::none(),
           "Returns a mesh of the map, or of its triangles in a Box.")
      .def("clear", &MapperSession::clear, py::call_guard<py::gil_scoped_release>(),
           "Empties the map.")
      .def(
          "clear_region",
          [](MapperSession& self, const Region& region) {
            return withMapper(self, [&](Mapper& m) { return m.clearRegion(region).voxels; });
          },
          py::arg("region"),
          "Empties the voxels in a Box or a Sphere; returns how many were not empty.")
      .def(
          "blocks",
          [](MapperSession& self) {
            return std::make_unique<Blocks>(self.contents(), self.params().map.voxel_size_m);
          },
          py::call_guard<py::gil_scoped_release>(), "A copy of the voxels, as arrays.")
      .def("save", &saveSession, py::arg("path"), py::arg("map_frame") = py::none(),
           "Saves the map as a .dtsdf file. map_frame: name of W, for programs that check it.\n"
           "Returns a dict: blocks, file_bytes, content_hash (equal for equal maps).")
      .def_property_readonly("space", &spaceOf,
                             "The free-space grid. Raises RuntimeError unless space/enabled.")
      .def_property_readonly(
          "settings", [](const MapperSession& self) { return toTree(self.params()); },
          "All settings, as a flat dict.")
      .def_property_readonly("stats", &statsOf, "Sizes of the map, as a dict; memory in bytes.")
      .def_property_readonly(
          "T_W_M", [](const MapperSession& self) { return matrixOf(self.levelPose()); },
          "4 x 4, in metres: from the poses' frame to the frame of a levelled map. Apply\n"
          "it to the poses of further frames. None if the map is not levelled.")
      .def_property_readonly(
          "backend",
          [](MapperSession& self) {
            return withMapper(self, [](Mapper& mapper) { return mapper.backendName(); });
          },
          "\"cpu (2 threads)\" or \"cuda (name of the device)\".")
      .def("__repr__", [](MapperSession& self) {
        return withMapper(self, [](Mapper& mapper) {
          return "<dtsdf_mapping.Mapper: " + mapper.backendName() + ", " +
                 std::to_string(mapper.stats().blocks) + " blocks>";
        });
      });
  refusePickle(mapper, "Mapper", "save(path) it, and Mapper.load(path) in the other process");
}

}  // namespace dtsdf::python
