// SPDX-License-Identifier: Apache-2.0
#include "frames.hpp"

#include <string>
#include <utility>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <striper/capture/list_cameras.hpp>
#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>

#include "bindings.hpp"
#include "events.hpp"
#include "numpy_arrays.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

using SharedFrame = std::shared_ptr<Frame>;

const char* word_of(FrameStatus status) {
  switch (status) {
    case FrameStatus::kOk:
      return "ok";
    case FrameStatus::kCorrupt:
      return "corrupt";
    case FrameStatus::kIncomplete:
      return "incomplete";
    case FrameStatus::kWrongSize:
      return "wrong_size";
  }
  return "";
}

const char* word_of(Field field) {
  switch (field) {
    case Field::kProgressive:
      return "progressive";
    case Field::kTop:
      return "top";
    case Field::kBottom:
      return "bottom";
    case Field::kInterlacedTopFirst:
      return "interlaced_top_first";
    case Field::kInterlacedBottomFirst:
      return "interlaced_bottom_first";
  }
  return "";
}

// Of images that a program has itself.
SharedFrame make_frame(const py::array& image, std::uint64_t sequence, double time_s,
                       std::optional<int> bit_depth) {
  auto frame = std::make_shared<Frame>();
  frame->image = image_of(image);
  frame->bit_depth = bit_depth.value_or(frame->image.depth() == CV_8U ? 8 : 16);
  const int most = frame->image.depth() == CV_8U ? 8 : 16;
  if (frame->bit_depth < 8 || frame->bit_depth > most) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("bit_depth {} - expected 8 to {}", frame->bit_depth, most));
  }
  frame->sensor_size = frame->image.size();
  frame->sequence = sequence;
  frame->time = FrameTime::at_seconds(time_s);
  return frame;
}

std::string text_of(const Frame& frame) {
  return fmt::format("<striper.Frame {}: {}x{}, {} bit, {}>", frame.sequence, frame.image.cols,
                     frame.image.rows, frame.bit_depth, word_of(frame.status));
}

void bind_frame(py::module_& module) {
  py::class_<Frame, SharedFrame>(module, "Frame", "One exposure, or the two fields of a frame.")
      .def(py::init(&make_frame), py::arg("image"), py::arg("sequence") = 0, py::arg("time") = 0.0,
           py::arg("bit_depth") = py::none())
      .def_property_readonly(
          "image",
          [](const py::object& self) { return image_array(self.cast<const Frame&>().image, self); },
          "The pixels: uint8 or uint16, (rows, columns) or (rows, columns, 3) as B, G, R. "
          "Read-only, "
          "no copy.")
      .def_readonly("sequence", &Frame::sequence, "The source's number of the frame.")
      .def_property_readonly(
          "time", [](const Frame& f) { return f.time.seconds(); },
          "Middle of the exposure, seconds since 1970, or since the first frame without a clock.")
      .def_readonly("bit_depth", &Frame::bit_depth)
      .def_property_readonly("field", [](const Frame& f) { return word_of(f.field); })
      .def_property_readonly(
          "status", [](const Frame& f) { return word_of(f.status); },
          "ok, corrupt, incomplete or wrong_size.")
      .def_readonly("status_detail", &Frame::status_detail)
      .def_property_readonly(
          "laser",
          [](const Frame& f) {
            return f.illumination.is_lit() ? std::optional<int>(f.illumination.laser_index())
                                           : std::nullopt;
          },
          "Which laser the source knows to have lit it; None: dark, or not known.")
      .def_property_readonly(
          "exposure_s", [](const Frame& f) { return 1e-9 * static_cast<double>(f.exposure_ns); })
      .def_readonly("encoder_counts", &Frame::encoder_counts)
      .def("__repr__", text_of);
}

void bind_source_info(py::module_& module) {
  py::class_<SourceInfo>(module, "SourceInfo", "What a source is and gives.")
      .def_readonly("uri", &SourceInfo::uri, "The address that opens it again.")
      .def_readonly("description", &SourceInfo::description)
      .def_property_readonly("width", [](const SourceInfo& i) { return i.image_size.width; })
      .def_property_readonly("height", [](const SourceInfo& i) { return i.image_size.height; })
      .def_readonly("bit_depth", &SourceInfo::bit_depth)
      .def_readonly("channels", &SourceInfo::channels)
      .def_readonly("is_live", &SourceInfo::is_live)
      .def_readonly("picture_rate_hz", &SourceInfo::picture_rate_hz, "Nominal; 0: unknown.")
      .def_readonly("pictures", &SourceInfo::pictures, "How many there are; None: unknown.")
      .def_property_readonly("cadence", [](const SourceInfo& i) { return i.pattern.to_string(); });
}

py::object value_of(const Control& control) {
  if (control.type == ControlType::kSwitch) return py::bool_(control.state.value.at(0) != 0.0);
  if (control.type == ControlType::kNumber) return py::float_(control.state.value.at(0));
  return py::tuple(py::cast(control.state.value));
}

ControlValue value_of(const py::object& given) {
  if (py::isinstance<py::sequence>(given)) return given.cast<ControlValue>();
  return {given.cast<double>()};
}

void bind_control(py::module_& module) {
  py::class_<Control>(module, "Control", "What can be set on a source while it runs.")
      .def_readonly("name", &Control::name)
      .def_readonly("unit", &Control::unit)
      .def_property_readonly("value", [](const Control& c) { return value_of(c); })
      .def_property_readonly("minimum", [](const Control& c) { return c.state.minimum; })
      .def_property_readonly("maximum", [](const Control& c) { return c.state.maximum; })
      .def_property_readonly("is_writable", [](const Control& c) { return c.state.is_writable; });
}

py::dict statistics_of(Source& source) {
  const SourceStatistics s = source.frames().statistics();
  using py::literals::operator""_a;
  return py::dict("delivered"_a = s.delivered, "dropped"_a = s.dropped, "overrun"_a = s.overrun,
                  "corrupt"_a = s.corrupt, "incomplete"_a = s.incomplete,
                  "wrong_size"_a = s.wrong_size, "reconnects"_a = s.reconnects);
}

// The next frame; None where the time is up. At the end of the source `at_end` is thrown.
template <typename AtEnd>
py::object next_frame(Source& source, std::optional<double> timeout_s, const AtEnd& at_end) {
  auto frame = std::make_shared<Frame>();
  const NextStatus status = source.next(*frame, timeout_s);
  if (status == NextStatus::kTimeout) return py::none();
  if (status != NextStatus::kFrame) at_end();
  return py::cast(frame);
}

void bind_source(py::module_& module) {
  const auto free = py::call_guard<py::gil_scoped_release>();
  py::class_<Source, std::shared_ptr<Source>>(module, "Source",
                                              "Frames from a camera, files or the simulator: `with "
                                              "open_source(uri) as source: for frame in "
                                              "source: ...`. One thread reads.")
      .def_property_readonly("info", &Source::info)
      .def("start", &Source::start, free, "Begins to stream; the first frame does so by itself.")
      .def("stop", &Source::stop, free, "Stops; a file starts again from its first frame.")
      .def(
          "next",
          [](Source& source, std::optional<double> timeout) {
            return next_frame(source, timeout, [] { raise_end("the source has ended"); });
          },
          py::arg("timeout") = py::none(),
          "The next frame; None where `timeout` seconds have passed. Raises EOFError at the end.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__",
           [](Source& source) {
             return next_frame(source, std::nullopt, [] { throw py::stop_iteration(); });
           })
      .def("__enter__",
           [](py::object self) {
             {
               Source& source = self.cast<Source&>();
               const py::gil_scoped_release unlocked;
               source.start();
             }
             return self;
           })
      .def("__exit__",
           [](Source& source, const py::args&) {
             const py::gil_scoped_release unlocked;
             source.stop();
           })
      .def_property_readonly("statistics", statistics_of, "Counts since it was opened.")
      .def(
          "controls", [](Source& source) { return source.frames().controls().list(); }, free,
          "What can be set, with its bounds.")
      .def(
          "get",
          [](Source& source, const std::string& name) {
            return source.frames().controls().get(name);
          },
          free, py::arg("name"))
      .def(
          "set",
          [](Source& source, const std::string& name, const py::object& given) {
            const ControlValue value = value_of(given);
            const py::gil_scoped_release unlocked;
            return source.frames().controls().set(name, value);
          },
          py::arg("name"), py::arg("value"), "Sets a value; what the device made of it.");
}

}  // namespace

void Source::start() {
  frames().start();
  is_started_ = true;
}

void Source::stop() {
  frames().stop();
  is_started_ = false;
}

NextStatus Source::next(Frame& frame, std::optional<double> timeout_s) {
  if (!is_started_) {
    const py::gil_scoped_release unlocked;
    start();
  }
  const auto next = [&](std::chrono::milliseconds time) { return frames().next(frame, time); };
  return wait_for_next(next, timeout_s);
}

void bind_frames(py::module_& module) {
  bind_frame(module);
  bind_source_info(module);
  bind_control(module);
  bind_source(module);
  module.def(
      "open_source",
      [](const std::string& uri, const py::object& on_event) {
        const EventPort events = port_of(on_event);
        std::unique_ptr<FrameSource> source;
        {
          const py::gil_scoped_release unlocked;
          source = open_source(uri, events);
        }
        return std::make_shared<Source>(std::move(source));
      },
      py::arg("uri"), py::kw_only(), py::arg("on_event") = py::none(),
      "Opens a source of frames: sim:SCENE, images:DIR, mcap:FILE, v4l2:/dev/videoN, gige:CAMERA.");
}

}  // namespace striper::python
