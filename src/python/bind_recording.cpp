#include "dtsdf_mapping/io/recording.h"
#include "python/module.h"
#include "python/values.h"

namespace dtsdf::python {
namespace {

RecordingOptions optionsOf(const py::object& path, const std::string& format,
                           const std::optional<Eigen::MatrixXd>& K,
                           std::optional<double> units_per_metre, const py::object& poses,
                           double pose_tolerance_s, size_t first, std::optional<size_t> last,
                           size_t step, const std::string& pose_convention, bool skip_bad) {
  if (step == 0) throw py::value_error("step must be at least 1");
  RecordingOptions options;
  options.path = pathOf(path);
  options.format = format;
  if (K) options.intrinsics = intrinsicsOf(*K);
  options.units_per_metre = units_per_metre;
  if (!poses.is_none()) options.poses_path = pathOf(poses);
  options.pose_tolerance_s = pose_tolerance_s;
  options.selection.first = first;
  if (last) options.selection.last = *last;
  options.selection.step = step;
  options.pose_convention = pose_convention;
  options.skip_bad = skip_bad;
  return options;
}

py::array depthOf(const py::object& self) {
  const DepthFrame& depth = self.cast<const SourceFrame&>().depth;
  const std::vector<py::ssize_t> shape = {depth.height, depth.width};
  const auto row = static_cast<py::ssize_t>(depth.row_bytes);
  if (depth.encoding == DepthEncoding::kUint16) {
    return viewOf(static_cast<const uint16_t*>(depth.data), shape, self, {row, 2});
  }
  return viewOf(static_cast<const float*>(depth.data), shape, self, {row, 4});
}

const char* encodingName(ColourEncoding encoding) {
  return kEncodings[static_cast<size_t>(encoding)];
}

py::array colourOf(const py::object& self) {
  const ColourFrame& colour = self.cast<const SourceColour&>().colour;
  const std::string name = encodingName(colour.encoding);
  const auto row = static_cast<py::ssize_t>(colour.row_bytes);
  const auto* const data = static_cast<const uint8_t*>(colour.data);
  if (name == "mono8") return viewOf(data, {colour.height, colour.width}, self, {row, 1});
  const py::ssize_t channels = name.size() == 5 ? 4 : 3;
  return viewOf(data, {colour.height, colour.width, channels}, self, {row, channels, 1});
}

/// Binds the common properties of depth and colour images; `frame` points to the
/// member that holds the frame.
template <class Image, class Frame>
void bindCommon(py::class_<Image>& image, Frame Image::*frame) {
  image
      .def_property_readonly(
          "K", [frame](const Image& self) { return matrixOf((self.*frame).intrinsics); },
          "(3, 3) float64, in pixels.")
      .def_property_readonly(
          "T_W_C",
          [frame](const Image& self) { return matrixOf(std::optional((self.*frame).T_W_C)); },
          "(4, 4) float64: optical frame to map frame, in metres.")
      .def_readonly("stamp_s", &Image::stamp_s, "Time stamp, in seconds.")
      .def_readonly("index", &Image::index, "Index in the recording, from 0.");
}

void bindFrames(py::module& m) {
  py::class_<SourceFrame> depth(m, "DepthImage", "A depth image from a recording.");
  depth
      .def_property_readonly("depth", &depthOf,
                             "(H, W) uint16 in unit_m, or float32 in metres; a view.")
      .def_property_readonly(
          "unit_m", [](const SourceFrame& f) { return f.depth.unit_m; },
          "Metres per unit of depth.");
  bindCommon(depth, &SourceFrame::depth);
  py::class_<SourceColour> colour(m, "ColourImage", "A colour image from a recording.");
  colour.def_property_readonly("colour", &colourOf, "(H, W, C) or (H, W) uint8; a view.")
      .def_property_readonly(
          "encoding", [](const SourceColour& c) { return encodingName(c.colour.encoding); },
          "rgb8, bgr8, rgba8, bgra8 or mono8.");
  bindCommon(colour, &SourceColour::colour);
}

/// __next__ holds the GIL, so only one thread at a time reads images.
template <class Image>
auto bindSource(py::module& m, const char* name) {
  using Source = ImageSource<Image>;
  return py::class_<Source>(m, name)
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__",
           [](Source& self) {
             std::optional<Image> next = self.next();
             if (!next) throw py::stop_iteration();
             return std::move(*next);
           })
      .def_property_readonly("skipped", [](const Source& self) { return self.skipped(); });
}

}  // namespace

void bindRecording(py::module& m) {
  bindFrames(m);
  py::class_<RecordingOptions>(m, "RecordingOptions")
      .def(py::init(&optionsOf), py::arg("path"), py::arg("format") = "", py::arg("K") = py::none(),
           py::arg("units_per_metre") = py::none(), py::arg("poses") = py::none(),
           py::arg("pose_tolerance_s") = 0.02, py::arg("first") = 0, py::arg("last") = py::none(),
           py::arg("step") = 1, py::arg("pose_convention") = "", py::arg("skip_bad") = false)
      .def_readonly("path", &RecordingOptions::path)
      .def("open_depth", &openRecording)
      .def("open_colour", &openRecordingColours);
  bindSource<SourceFrame>(m, "DepthImages")
      .def_property_readonly("size", [](const FrameSource& self) { return self.size(); });
  bindSource<SourceColour>(m, "ColourImages");
  m.def("recording_formats", &recordingFormats, "Names of the recording formats.");
}

}  // namespace dtsdf::python
