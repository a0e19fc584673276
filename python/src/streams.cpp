// SPDX-License-Identifier: Apache-2.0
// Scans, from an address or from frames one by one.
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include <striper/scan/scan_pool.hpp>
#include <striper/scans/open_scans.hpp>

#include "bindings.hpp"
#include "events.hpp"
#include "frames.hpp"
#include "models.hpp"
#include "options.hpp"
#include "scans.hpp"

namespace py = pybind11;

namespace striper::python {
namespace {

// Scans as they come; each stays as long as somebody holds it.
class ScanStream {
 public:
  explicit ScanStream(std::unique_ptr<ScanSource> source)
      : source_(std::move(source)), info_(source_->info()) {}

  const HeadInfo& info() const noexcept { return info_; }

  SharedScan next(std::optional<double> timeout_s, NextStatus& status) {
    SharedScan scan = pool_.take();
    const auto next = [&](std::chrono::milliseconds time) { return source_->next(*scan, time); };
    status = wait_for_next(next, timeout_s);
    return scan;
  }

  void stop() { source_->stop(); }

 private:
  Unlocked<std::unique_ptr<ScanSource>> source_;
  HeadInfo info_;
  ScanPool pool_;
};

template <typename AtEnd>
py::object next_scan(ScanStream& stream, std::optional<double> timeout_s, const AtEnd& at_end) {
  NextStatus status{};
  const SharedScan scan = stream.next(timeout_s, status);
  if (status == NextStatus::kTimeout) return py::none();
  if (status != NextStatus::kFrame) at_end();
  return py::cast(scan);
}

std::shared_ptr<ScanStream> open_stream(const std::string& uri, const py::object& model,
                                        const py::object& on_event, const py::kwargs& given) {
  const EventPort events = port_of(on_event);
  const std::shared_ptr<const StriperModel> loaded = model_of(model, events);
  std::optional<ScannerOptions> options;
  if (!given.empty()) options = scanner_options_of(loaded.get(), given);
  std::unique_ptr<ScanSource> source;
  {
    const py::gil_scoped_release unlocked;
    source = open_scans(uri, loaded, options, events);
  }
  return std::make_shared<ScanStream>(std::move(source));
}

void bind_stream(py::module_& module) {
  py::class_<ScanStream, std::shared_ptr<ScanStream>>(
      module, "ScanStream", "Scans, one after the other: `for scan in striper.scan(...)`.")
      .def_property_readonly("info", [](const ScanStream& s) { return s.info().source; })
      .def_property_readonly(
          "model",
          [](const ScanStream& s) { return std::const_pointer_cast<StriperModel>(s.info().model); },
          "What the ranges are computed with; None where nobody knows.")
      .def(
          "next",
          [](ScanStream& stream, std::optional<double> timeout) {
            return next_scan(stream, timeout, [] { raise_end("there are no more scans"); });
          },
          py::arg("timeout") = py::none(),
          "The next scan; None where `timeout` seconds have passed. Raises EOFError at the end.")
      .def("stop", &ScanStream::stop, py::call_guard<py::gil_scoped_release>(),
           "Makes a waiting `next` end; from any thread.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__",
           [](ScanStream& stream) {
             return next_scan(stream, std::nullopt, [] { throw py::stop_iteration(); });
           })
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](ScanStream& stream, const py::args&) {
        const py::gil_scoped_release unlocked;
        stream.stop();
      });
  module.def("scan", open_stream, py::arg("uri"), py::arg("model") = py::none(), py::kw_only(),
             py::arg("on_event") = py::none());
}

// A scanner of frames that come from anywhere.
class FrameScanner {
 public:
  explicit FrameScanner(Scanner scanner)
      : scanner_(std::make_unique<Scanner>(std::move(scanner))) {}

  std::vector<SharedScan> process(const Frame& frame) { return shared(scanner_->process(frame)); }
  std::vector<SharedScan> finish() { return shared(scanner_->finish()); }
  ScannerStatus status() const { return scanner_->status(); }

 private:
  static std::vector<SharedScan> shared(ScanSpan scans) {
    std::vector<SharedScan> kept;
    for (std::size_t i = 0; i < scans.size(); ++i) kept.push_back(shared_scan(scans.shared(i)));
    return kept;
  }

  Unlocked<std::unique_ptr<Scanner>> scanner_;
};

std::shared_ptr<FrameScanner> make_scanner(const py::object& model, const py::object& source,
                                           const py::object& on_event, const py::kwargs& given) {
  const EventPort events = port_of(on_event);
  const std::shared_ptr<const StriperModel> loaded = model_of(model, events);
  ScannerOptions options = scanner_options_of(loaded.get(), given);
  options.events = events;
  if (!source.is_none()) options.ambient.pattern = source.cast<SourceInfo>().pattern;
  const py::gil_scoped_release unlocked;
  Scanner scanner = loaded ? Scanner(*loaded, options) : Scanner(options);
  return std::make_shared<FrameScanner>(std::move(scanner));
}

void bind_scanner(py::module_& module) {
  const auto free = py::call_guard<py::gil_scoped_release>();
  py::class_<FrameScanner, std::shared_ptr<FrameScanner>>(
      module, "Scanner", "Turns frames into scans. One stream, in order; one thread at a time.")
      .def(py::init(&make_scanner), py::arg("model") = py::none(), py::arg("source") = py::none(),
           py::kw_only(), py::arg("on_event") = py::none())
      .def(
          "process", &FrameScanner::process, free, py::arg("frame"),
          "The scans of the next frame: usually one; none for a dark one, or while frames are held "
          "until the illumination pattern is known.")
      .def("finish", &FrameScanner::finish, free, "What is still held, at the end of a stream.")
      .def_property_readonly("status", [](const FrameScanner& scanner) {
        const ScannerStatus status = scanner.status();
        using py::literals::operator""_a;
        return py::dict("axis"_a = std::string(to_string(status.axis)),
                        "is_stripe_seen"_a = status.is_stripe_seen,
                        "frames"_a = status.counts.frames, "scans"_a = status.counts.scans,
                        "without_stripe"_a = status.counts.without_stripe,
                        "dark"_a = status.counts.dark, "unpaired"_a = status.counts.unpaired,
                        "lit_s"_a = status.counts.lit_s, "refused"_a = status.counts.refused);
      });
}

}  // namespace

void bind_streams(py::module_& module) {
  bind_stream(module);
  bind_scanner(module);
  module.def("scanner_options", scanner_option_table,
             "What scan() and Scanner() may be given: name, unit, bounds or words, help.");
}

}  // namespace striper::python
