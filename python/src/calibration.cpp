// SPDX-License-Identifier: Apache-2.0
// A calibration from images: files, patterns, directories or arrays.
#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <striper/core/error.hpp>
#include <striper/images/picture_files.hpp>
#include <striper/images/read_picture.hpp>
#include <striper/intrinsics/camera_file.hpp>
#include <striper/session/calibrate.hpp>

#include "bindings.hpp"
#include "numpy_arrays.hpp"
#include "waiting.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

using Images = std::vector<SessionImage>;

// What ends a calibration that nobody waits for any more.
struct Cancelled {};

bool is_path(const py::handle& given) {
  return py::isinstance<py::str>(given) || py::hasattr(given, "__fspath__");
}

void add_images(const py::handle& given, Images& images) {
  if (py::isinstance<py::array>(given)) {
    const cv::Mat image = image_of(py::reinterpret_borrow<py::array>(given));
    images.emplace_back(fmt::format("image {}", images.size()), image,
                        image.depth() == CV_8U ? 8 : 16);
    return;
  }
  if (!is_path(given)) {
    for (const py::handle& part : given) add_images(part, images);
    return;
  }
  const auto read = [](const std::filesystem::path& path) { return read_image(path).image; };
  for (const auto& file : image_files(given.cast<std::filesystem::path>().string())) {
    images.emplace_back(file, read);
  }
}

Images images_of(const py::handle& given) {
  Images images;
  add_images(given, images);
  return images;
}

// One laser's images, or a list of those of several.
template <typename Add>
void for_each_laser(const py::object& given, const Add& add) {
  if (is_path(given)) return add(given);
  for (const py::handle& laser : given) add(laser);
}

CalibrationInput input_of(const Board& board, const py::object& boards, const py::object& lasers,
                          const py::object& pairs) {
  CalibrationInput input{.board = board, .boards = images_of(boards), .lasers = {}};
  for_each_laser(lasers, [&](const py::handle& one) {
    input.lasers.push_back({images_of(one), {}});
  });
  const bool are_lasers_alone = !input.lasers.empty();
  for (const py::handle& pair : pairs) {
    const auto both = py::cast<py::sequence>(pair);
    if (is_path(pair) || both.size() != 2) {
      throw Error(ErrorKind::kUsage, "pairs: expected for each laser (off, on)");
    }
    input.lasers.push_back({images_of(both[1]), images_of(both[0])});
    if (input.lasers.back().on.size() != input.lasers.back().off.size()) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("pairs: {} images with the laser off and {} with it on; they must "
                              "be the same poses in the same order",
                              input.lasers.back().off.size(), input.lasers.back().on.size()));
    }
    if (are_lasers_alone) {
      throw Error(ErrorKind::kUsage, "lasers and pairs together leave open which laser is which");
    }
  }
  if (input.boards.empty() && input.lasers.empty()) {
    throw Error(ErrorKind::kUsage, "no images: give boards, lasers or pairs");
  }
  return input;
}

LensModel lens_of(const std::string& word) {
  const auto lens = lens_model_from_string(word == "rational" ? "rational_polynomial" : word);
  if (lens) return *lens;
  throw Error(ErrorKind::kUsage,
              fmt::format("lens '{}' - expected auto, plumb_bob, rational or equidistant", word));
}

CalibrationOptions options_of(const std::string& lens, const std::string& axis,
                              const std::string& channel, const py::object& intrinsics) {
  CalibrationOptions options;
  if (lens != "auto") options.lens = lens_of(lens);
  if (axis != "auto") {
    options.axis = stripe_axis_from_string(axis);
    if (!options.axis)
      throw Error(ErrorKind::kUsage,
                  fmt::format("axis '{}' - expected auto, columns or rows", axis));
  }
  const auto asked = channel_from_string(channel);
  if (!asked) throw Error(ErrorKind::kUsage, fmt::format("channel '{}' is none", channel));
  options.channel = *asked;
  if (!intrinsics.is_none())
    options.known_camera = load_camera(intrinsics.cast<std::filesystem::path>());
  return options;
}

// Hands what is reported to Python; what it raises ends the calibration.
class Progress {
 public:
  explicit Progress(py::object callback) : callback_(std::move(callback)) {}

  void operator()(const std::string& stage, double fraction) {
    if (is_cancelled) throw Cancelled{};
    if (callback_.is_none()) return;
    const py::gil_scoped_acquire lock;
    try {
      callback_(stage, fraction);
    } catch (py::error_already_set& raised) {
      raised.restore();
      PyObject *type = nullptr, *value = nullptr, *trace = nullptr;
      PyErr_Fetch(&type, &value, &trace);
      raised_ = {type, value, trace};
      throw Cancelled{};
    }
  }

  // What the callback raised, again.
  void raise() {
    if (raised_[0] == nullptr) return;
    PyErr_Restore(raised_[0], raised_[1], raised_[2]);
    throw py::error_already_set();
  }

  std::atomic<bool> is_cancelled = false;

 private:
  py::object callback_;
  std::array<PyObject*, 3> raised_{};
};

std::shared_ptr<Calibration> calibrate_with(CalibrationInput input, CalibrationOptions options,
                                            const py::object& callback) {
  Progress progress(callback);
  options.progress = [&](const std::string& stage, double fraction) { progress(stage, fraction); };
  const auto work = [&] { return std::make_shared<Calibration>(calibrate(input, options)); };
  try {
    return run_interruptibly(work, [&] { progress.is_cancelled = true; });
  } catch (const Cancelled&) {
    progress.raise();
    throw;
  }
}

std::string today() {
  return py::module_::import("datetime")
      .attr("datetime")
      .attr("utcnow")()
      .attr("strftime")("%Y-%m-%dT%H:%M:%SZ")
      .cast<std::string>();
}

}  // namespace

void bind_calibration(py::module_& module) {
  py::class_<Calibration, std::shared_ptr<Calibration>>(module, "Calibration",
                                                        "A finished calibration.")
      .def_property_readonly(
          "model", [](const Calibration& c) { return std::make_shared<StriperModel>(c.model); },
          "With covariance.")
      .def_readonly("findings", &Calibration::findings, "Events, with advice.")
      .def_property_readonly(
          "refused", [](const Calibration& c) { return !c.trustworthy(); },
          "It must not be trusted; the findings say why.")
      .def_property_readonly("verdict", &Calibration::verdict, "A sentence.")
      .def_property_readonly("corners_rms_px",
                             [](const Calibration& c) { return c.solution.corners.rms_px; })
      .def_property_readonly("stripes_rms_px",
                             [](const Calibration& c) { return c.solution.stripes.rms_px; })
      .def_property_readonly(
          "board_distances_m",
          [](const Calibration& c) {
            const BoardDistances d = c.board_distances();
            return py::make_tuple(d.nearest_m, d.median_m, d.farthest_m);
          },
          "Nearest, median, farthest.")
      .def("__repr__", [](const Calibration& c) {
        return fmt::format("<striper.Calibration: {}>", c.verdict());
      });
  module.def(
      "calibrate",
      [](const py::object& boards, const py::object& lasers, const py::object& pairs,
         const std::string& board, double square, const std::string& lens, const std::string& axis,
         const std::string& channel, const py::object& intrinsics, bool like_opencv, bool force,
         const py::object& progress) {
        CalibrationOptions options = options_of(lens, axis, channel, intrinsics);
        options.like_opencv = like_opencv;
        options.force = force;
        options.date = today();
        return calibrate_with(input_of(parse_board(board, square), boards, lasers, pairs), options,
                              progress);
      },
      py::arg("boards") = py::tuple(), py::arg("lasers") = py::tuple(),
      py::arg("pairs") = py::tuple(), py::arg("board") = "8x6", py::arg("square") = 0.04,
      py::kw_only(), py::arg("lens") = "auto", py::arg("axis") = "auto",
      py::arg("channel") = "auto", py::arg("intrinsics") = py::none(),
      py::arg("like_opencv") = false, py::arg("force") = false, py::arg("progress") = py::none());
}

}  // namespace striper::python
