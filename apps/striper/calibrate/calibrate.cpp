// SPDX-License-Identifier: Apache-2.0
// striper calibrate: images of a board, with and without the laser on it, become a model.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/images/picture_files.hpp>
#include <striper/images/read_picture.hpp>
#include <striper/intrinsics/camera_file.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/report/report.hpp>
#include <striper/session/calibrate.hpp>

#include "program/interruptible.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct CalibrateArguments {
  std::string board;
  double square_m = 0.0;
  std::vector<std::string> boards;
  std::vector<std::vector<std::string>> lasers;
  std::vector<std::vector<std::string>> pairs;
  std::string intrinsics;
  std::string lens = "auto";
  std::string axis = "auto";
  std::string channel = "auto";
  bool like_opencv = false;
  bool force = false;
  std::string camera_info;
  std::string output;
  std::string report;
  bool json = false;
};

constexpr const char* kDescription =
    "Calibrate: images of a checkerboard, with and without the laser on it, become a model.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper calibrate --board 8x6 --square 0.040 --boards boards/ --lasers lit/ -o "
    "striper.yaml\n"
    "      boards/ shows the board, lit/ the board and the stripe on it in one image\n"
    "  striper calibrate --board 8x6 --square 0.040 --pairs 'off/*.png' 'on/*.png' -o "
    "striper.yaml\n"
    "      the same pose twice, laser off then on: the surest way\n"
    "  striper calibrate --board 8x6 --square 0.040 --boards boards/ -o camera.yaml\n"
    "      the camera alone; later: --intrinsics camera.yaml --lasers lit/\n"
    "  striper calibrate ... --lasers first/ --lasers second/ -o striper.yaml\n"
    "      two lasers: the k-th --lasers (or --pairs) is laser k\n\n"
    "Ten to twenty poses: tilted by 30 to 45 degrees each way, near and far, everywhere in the\n"
    "image, the stripe on the board or on its white margin. The report says what is missing.\n"
    "Images that cannot be read are left out, with a warning that names them.\n"
    "It prints how far the boards were, how the stripe is read (and what other ways would have\n"
    "given) and what it looks like; the model keeps its width, brightness and colour.\n"
    "Exit code 3: the images cannot give a model that is to be trusted; nothing is written\n"
    "(--force writes it all the same, marked).";

void define(Command& command, CalibrateArguments& arguments) {
  command.add_option("--board", arguments.board, "Inner corners, 8x6, or circles:7x7")
      ->type_name("SIZE")
      ->required();
  command.add_option("--square", arguments.square_m, "Side of a square (or spacing), metres")
      ->type_name("M")
      ->check(above_zero())
      ->required();
  command.add_option("--boards", arguments.boards, "Images of the board")->type_name("GLOB...");
  command
      .add_option("--lasers", arguments.lasers,
                  "Images of board and stripe together; again for the next laser")
      ->type_name("GLOB...");
  command
      .add_option("--pairs", arguments.pairs,
                  "The same poses twice: laser off, laser on; again for the next laser")
      ->type_name("OFF ON");
  command
      .add_option("--intrinsics", arguments.intrinsics,
                  "A camera known beforehand, held: a model, ROS camera_info or OpenCV file")
      ->type_name("FILE");
  command
      .add_option("--lens", arguments.lens,
                  "plumb_bob, rational, equidistant; auto: by cross-validation")
      ->type_name("NAME")
      ->check(one_of({"auto", "plumb_bob", "rational", "equidistant"}));
  command
      .add_option(
          "--axis", arguments.axis,
          "How the stripe is read: a place per image column or row; auto: by the planes' fit")
      ->type_name("AXIS")
      ->check(one_of({"auto", "columns", "rows"}));
  command
      .add_option("--channel", arguments.channel,
                  "What of a colour image shows the stripe; auto: by the planes' fit")
      ->type_name("NAME")
      ->check(one_of({"auto", "grey", "red", "green", "blue", "green-red", "red-green"}));
  command.add_flag(
      "--like-opencv", arguments.like_opencv,
      "Corners as OpenCV's calibration sample has them and none left out, to compare figures "
      "(with --lens plumb_bob)");
  command.add_flag("--force", arguments.force, "Write a model that must not be trusted, marked");
  command.add_option("--camera-info", arguments.camera_info, "Also write a ROS camera_info YAML")
      ->type_name("FILE");
  command.add_option("-o,--output", arguments.output, "The model")->type_name("FILE")->required();
  command.add_option("--report", arguments.report, "Also write a report for people, HTML")
      ->type_name("FILE");
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(kExamples);
}

std::vector<SessionImage> images_of(const std::string& pattern) {
  std::vector<SessionImage> images;
  for (const auto& path : image_files(pattern))
    images.emplace_back(path, [](const auto& file) { return read_image(file).image; });
  return images;
}

std::vector<SessionImage> images_of(const std::vector<std::string>& patterns) {
  std::vector<SessionImage> images;
  for (const std::string& pattern : patterns)
    for (SessionImage& image : images_of(pattern)) images.push_back(std::move(image));
  return images;
}

// Two patterns, or the even list that the shell has made of them: first half off, second half on.
LaserImages pair_up(const std::vector<std::string>& words) {
  LaserImages laser;
  if (words.size() == 2) {
    laser.off = images_of(words[0]);
    laser.on = images_of(words[1]);
  } else {
    if (words.size() % 2 != 0)
      throw Error(ErrorKind::kUsage,
                  fmt::format("--pairs got {} images; expected as many with the laser off as on",
                              words.size()));
    const auto half = words.begin() + static_cast<std::ptrdiff_t>(words.size() / 2);
    laser.off = images_of(std::vector<std::string>(words.begin(), half));
    laser.on = images_of(std::vector<std::string>(half, words.end()));
  }
  if (laser.off.size() != laser.on.size())
    throw Error(ErrorKind::kUsage,
                fmt::format("--pairs names {} images with the laser off and {} with it on; they "
                            "must be the same poses in the same order",
                            laser.off.size(), laser.on.size()));
  return laser;
}

CalibrationInput input_of(const CalibrateArguments& arguments) {
  CalibrationInput input;
  input.board = parse_board(arguments.board, arguments.square_m);
  input.boards = images_of(arguments.boards);
  for (const auto& words : arguments.lasers) input.lasers.push_back({images_of(words), {}});
  for (const auto& words : arguments.pairs) input.lasers.push_back(pair_up(words));
  if (input.boards.empty() && input.lasers.empty())
    throw Error(ErrorKind::kUsage, "no images: give --boards, --lasers or --pairs");
  if (!arguments.lasers.empty() && !arguments.pairs.empty())
    throw Error(ErrorKind::kUsage,
                "--lasers and --pairs together leave open which laser is which; use one of them");
  return input;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

CalibrationOptions options_of(const CalibrateArguments& arguments) {
  CalibrationOptions options;
  if (arguments.lens == "plumb_bob") options.lens = LensModel::kPlumbBob;
  if (arguments.lens == "rational") options.lens = LensModel::kRationalPolynomial;
  if (arguments.lens == "equidistant") options.lens = LensModel::kEquidistant;
  if (arguments.axis != "auto") options.axis = stripe_axis_from_string(arguments.axis);
  if (arguments.channel != "auto") options.channel = *channel_from_string(arguments.channel);
  if (!arguments.intrinsics.empty()) options.known_camera = load_camera(arguments.intrinsics);
  options.like_opencv = arguments.like_opencv;
  options.force = arguments.force;
  options.date = today();
  return options;
}

// How the stripe is read, and what the other ways would have given.
void say_compared_settings(const Calibration& calibration) {
  const StriperModel& model = calibration.model;
  say(fmt::format("stripe: axis {}, channel {}{}", to_string(model.axis), to_string(model.channel),
                  model.difference_channel ? fmt::format(" (with a dark exposure subtracted: {})",
                                                         to_string(*model.difference_channel))
                                           : std::string()));
  const auto longest =
      std::max_element(calibration.compared_settings.begin(), calibration.compared_settings.end(),
                       [](const auto& a, const auto& b) {
                         return to_string(a.settings).size() < to_string(b.settings).size();
                       });
  if (longest == calibration.compared_settings.end()) return;
  const std::size_t width = to_string(longest->settings).size();
  say(fmt::format("    {:{}}  stripes  on the plane  rms px", "read as", width));
  for (const SettingsScore& score : calibration.compared_settings)
    say(fmt::format(
        "    {:{}}  {:7}  {:12}  {}", to_string(score.settings), width, score.stripes,
        score.on_plane,
        score.on_plane > 0 ? fmt::format("{:6.3f}", score.rms_px) : std::string("     -")));
}

void say_look(std::size_t laser, const StripeLook& look) {
  if (!look.width_px) return;
  std::string text = fmt::format("laser {}: stripe {:.2f} px wide (sigma)", laser, *look.width_px);
  if (!look.width_at.empty())
    text += fmt::format(", {:.2f} px at {:.2f} m to {:.2f} px at {:.2f} m",
                        look.width_at.front().width_px, look.width_at.front().range_m,
                        look.width_at.back().width_px, look.width_at.back().range_m);
  if (!look.amplitude_at.empty())
    text += fmt::format("; on white paper {:.0f} DN at {:.2f} m to {:.0f} DN at {:.2f} m",
                        look.amplitude_at.front().amplitude_dn, look.amplitude_at.front().range_m,
                        look.amplitude_at.back().amplitude_dn, look.amplitude_at.back().range_m);
  if (look.colour)
    text += fmt::format("; blue {:.0f} %, green {:.0f} %, red {:.0f} %", 100.0 * (*look.colour)[0],
                        100.0 * (*look.colour)[1], 100.0 * (*look.colour)[2]);
  say(text);
}

void say_result(const Calibration& calibration) {
  for (const Event& finding : calibration.findings)
    say(fmt::format("{}: {}\n    {}", to_string(finding.severity), finding.message,
                    finding.advice));
  const BoardDistances boards = calibration.board_distances();
  say(fmt::format("boards: {:.2f} to {:.2f} m away, median {:.2f} m", boards.nearest_m,
                  boards.farthest_m, boards.median_m));
  if (calibration.model.lasers.empty())
    say("camera only: no laser (a model for scans needs --lasers or --pairs)");
  else
    say_compared_settings(calibration);
  for (std::size_t laser = 0; laser < calibration.model.lasers.size(); ++laser)
    say_look(laser, calibration.model.lasers[laser].look);
  for (std::size_t laser = 0; laser < calibration.range_sigmas.size(); ++laser)
    for (const RangeSigma& at : calibration.range_sigmas[laser])
      if (std::isfinite(at.sigma_m))
        say(fmt::format("laser {}: one-sigma calibration error at {:g} m: {:.2f} mm{}", laser,
                        at.range_m, 1e3 * at.sigma_m, at.inside_data ? "" : " (extrapolated)"));
  say(fmt::format("{} boards of {} images, {} stripes; corners {:.3f} px rms{}; {:.1f} s",
                  calibration.observations.views.size(), calibration.images.size(),
                  calibration.observations.stripes.size(), calibration.solution.corners.rms_px,
                  calibration.observations.stripes.empty()
                      ? std::string()
                      : fmt::format(", stripes {:.3f} px rms", calibration.solution.stripes.rms_px),
                  calibration.seconds));
  say(calibration.verdict());
}

nlohmann::json compared_settings_of(const Calibration& calibration) {
  nlohmann::json compared_settings = nlohmann::json::array();
  for (const SettingsScore& score : calibration.compared_settings)
    compared_settings.push_back({{"axis", to_string(score.settings.axis)},
                                 {"channel", to_string(score.settings.channel)},
                                 {"subtract_off", score.settings.subtract_off},
                                 {"stripes", score.stripes},
                                 {"on_plane", score.on_plane},
                                 {"rms_px", score.rms_px}});
  return compared_settings;
}

nlohmann::json summarize(const Calibration& calibration, const std::string& output) {
  nlohmann::json summary;
  summary["output"] = output;
  summary["trustworthy"] = calibration.trustworthy();
  summary["verdict"] = calibration.verdict();
  summary["views"] = calibration.observations.views.size();
  summary["stripes"] = calibration.observations.stripes.size();
  summary["corner_rms_px"] = calibration.solution.corners.rms_px;
  summary["stripe_rms_px"] = calibration.solution.stripes.rms_px;
  summary["seconds"] = calibration.seconds;
  const BoardDistances boards = calibration.board_distances();
  summary["boards_m"] = {
      {"nearest", boards.nearest_m}, {"median", boards.median_m}, {"farthest", boards.farthest_m}};
  if (!calibration.model.lasers.empty()) {
    summary["axis"] = to_string(calibration.model.axis);
    summary["channel"] = to_string(calibration.model.channel);
    if (calibration.model.difference_channel)
      summary["difference_channel"] = to_string(*calibration.model.difference_channel);
    summary["settings"] = compared_settings_of(calibration);
  }
  summary["findings"] = nlohmann::json::array();
  for (const Event& finding : calibration.findings)
    summary["findings"].push_back({{"severity", to_string(finding.severity)},
                                   {"code", finding.code.word()},
                                   {"message", finding.message},
                                   {"advice", finding.advice}});
  for (const auto& laser : calibration.range_sigmas) {
    nlohmann::json sigmas = nlohmann::json::array();
    for (const RangeSigma& at : laser)
      sigmas.push_back({{"range_m", at.range_m}, {"sigma_m", at.sigma_m}});
    summary["range_sigmas"].push_back(sigmas);
  }
  return summary;
}

// Before the work, not after it: a directory that is not there, a name that is given twice.
void check_outputs(const CalibrateArguments& arguments) {
  std::set<std::filesystem::path> outputs;
  for (const std::string& path : {arguments.output, arguments.report, arguments.camera_info}) {
    if (path.empty()) continue;
    require_writable(path);
    if (outputs.insert(std::filesystem::weakly_canonical(path)).second) continue;
    throw Error(ErrorKind::kUsage,
                fmt::format("'{}' is named twice: --output, --report and --camera-info need a file "
                            "each",
                            path));
  }
}

// The model, the report and what else is wanted; returns what was written, for people.
std::string write_results(const CalibrateArguments& arguments, const Calibration& calibration,
                          bool with_model) {
  std::vector<std::string> written;
  if (with_model) {
    save_model(calibration.model, arguments.output);
    written.push_back(arguments.output);
  }
  if (with_model && !arguments.camera_info.empty()) {
    save_camera_info(calibration.model.camera, "striper", arguments.camera_info);
    written.push_back(arguments.camera_info);
  }
  if (!arguments.report.empty()) {
    save_report(calibration, arguments.report);
    written.push_back(arguments.report);
  }
  return fmt::format("{}", fmt::join(written, ", "));
}

// Says the stages as it comes to them.
Calibration calibrate_aloud(const CalibrationInput& input, CalibrationOptions options) {
  Progress progress("% done", 100);
  std::string stage;
  options.progress = [&](const std::string& now, double fraction) {
    if (stop_requested()) return;  // Nobody waits for it.
    if (now != stage && now != "done") say(now);
    stage = now;
    progress.update(static_cast<std::uint64_t>(100.0 * fraction));
  };
  return calibrate(input, options);
}

ExitCode run_calibration(const CalibrateArguments& arguments) {
  check_outputs(arguments);
  const auto calibration = run_interruptible<Calibration>(
      [input = input_of(arguments), options = options_of(arguments)] {
        return calibrate_aloud(input, options);
      });
  say_result(calibration);
  const bool write = calibration.trustworthy() || arguments.force;
  const std::string written = write_results(arguments, calibration, write);
  if (!written.empty()) say("wrote " + written);
  if (!write) {
    say(fmt::format("{} was not written; --force writes it all the same, marked",
                    arguments.output));
  }
  if (arguments.json) print_json(summarize(calibration, write ? arguments.output : ""));
  return write ? ExitCode::kDone : ExitCode::kUntrustworthy;
}

}  // namespace

void add_calibrate(Command& striper, Action& action) {
  add_command<CalibrateArguments>(striper, action, "calibrate", kDescription, define,
                                  run_calibration);
}

}  // namespace striper::program
