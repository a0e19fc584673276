// SPDX-License-Identifier: Apache-2.0
// striper noise: read noise and DN per electron from frames without the laser.
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include <striper/ambient/channel_choice.hpp>
#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/stripe/extractor.hpp>
#include <striper/stripe/photon_transfer.hpp>

#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/frame_loop.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct NoiseArguments {
  std::string source;
  std::optional<std::string> covered;
  std::optional<double> black_dn;
  std::optional<std::string> model;
  std::optional<std::string> out;
  FrameLimits limits;
  bool json = false;
};

constexpr std::uint64_t kFrames = 32;
constexpr double kMostStriped = 0.5;

constexpr const char* kDescription =
    "Measure the camera's noise on frames without the laser: for true error bars.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper noise v4l2:/dev/video0 --model striper.yaml\n"
    "      laser off, a scene at rest with light and shade; writes the model's noise: block\n"
    "  striper noise gige: --covered images:lens-cap --model striper.yaml -o measured.yaml\n"
    "      frames with the lens covered tell the black level\n"
    "  striper noise 'images:walk?laser=0,dark'\n"
    "      the dark exposures of a sequence; without --model the block is printed\n\n"
    "Half the variance of the difference of successive exposures, against the light, is a line:\n"
    "read_noise_dn^2 + dn_per_electron * (DN - black_level_dn) + 1/12. The black level comes from\n"
    "--covered, --black or the model, and is 0 otherwise. Exit code 3 where the frames do not\n"
    "tell: the laser is on, too few, all the same, too even, compressed.";

void define(Command& command, NoiseArguments& arguments) {
  add_source(command, arguments.source);
  command
      .add_option("-m,--model", arguments.model,
                  "The striper whose noise it is; its noise: block is written anew")
      ->type_name("FILE");
  command.add_option("-o,--output", arguments.out, "Write the model here instead")
      ->type_name("FILE")
      ->needs("--model");
  CommandOption* const covered =
      command
          .add_option("--covered", arguments.covered,
                      "Frames of the same camera with the lens covered: the black level")
          ->type_name("SOURCE");
  command.add_option("--black", arguments.black_dn, "The black level, where it is known")
      ->type_name("DN")
      ->excludes(covered);
  add_frame_limits(command, arguments.limits);
  command.add_flag("--json", arguments.json, "The result for programs on the standard output");
  command.footer(std::string(kExamples) + "\n\n" + kSourceHelp);
}

// One channel of the dark exposures of a source.
class DarkExposures {
 public:
  DarkExposures(const SourceInfo& info, Channel channel, StripeAxis axis)
      : info_(info), channel_(channel == Channel::kAuto ? Channel::kGrey : channel), axis_(axis) {}

  /// Empty where the frame is lit or damaged. Valid until the next call.
  const cv::Mat* of(const Frame& frame) {
    if (frame.status != FrameStatus::kOk) return nullptr;
    if (info_.illumination_of(frame).is_lit()) {
      ++lit_;
      return nullptr;
    }
    select_channel(frame.image, channel_, images_);
    if (dark_++ == 0 && !frame.illumination.is_dark()) refuse_stripe(frame.full_scale_dn());
    return &images_.lit;
  }

  void refuse_without_dark() const {
    if (dark_ > 0 || lit_ == 0) return;
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("the laser is on in all {} exposures: switch it off, or say which are "
                            "dark with ?laser=0,dark",
                            lit_));
  }

 private:
  // The source does not know that the laser is off, whatever its user says.
  void refuse_stripe(int full_scale_dn) const {
    LitFrame frame;
    frame.lit = images_.lit;
    frame.full_scale_dn = full_scale_dn;
    ExtractOptions options;
    options.method = ExtractMethod::kFast;
    options.axis = axis_;
    Stripe stripe;
    make_extractor(options)->extract(frame, stripe);
    double good = 0.0;
    for (const ReturnStatus status : stripe.status) good += status == ReturnStatus::kOk ? 1 : 0;
    good /= static_cast<double>(std::max<std::size_t>(1, stripe.size()));
    if (good < kMostStriped) return;
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("there is a stripe in {:.0f} % of the image: switch the laser off, or "
                            "say which exposures are dark with ?laser=0,dark",
                            100.0 * good));
  }

  SourceInfo info_;
  Channel channel_;
  StripeAxis axis_;
  ChannelImages images_;
  int dark_ = 0;
  int lit_ = 0;
};

// Reads a source to its limit and hands every dark exposure on.
template <typename OnExposure>
void read_dark(const std::string& uri, const NoiseArguments& arguments,
               const std::optional<StriperModel>& model, const OnExposure& on_exposure) {
  const EventPort events = TerminalEvents().port();
  const auto source = open_source(uri, events);
  FrameLimits limits = arguments.limits;
  if (!limits.pictures && !limits.seconds) limits.pictures = kFrames;
  DarkExposures exposures(source->info(), model ? model->channel : Channel::kAuto,
                          model ? model->axis : StripeAxis::kColumns);
  read_frames(*source, limits, events, [&](const Frame& frame) {
    if (const cv::Mat* const image = exposures.of(frame)) on_exposure(frame, *image);
  });
  exposures.refuse_without_dark();
}

double black_level(const NoiseArguments& arguments, const std::optional<StriperModel>& model) {
  if (arguments.black_dn) return *arguments.black_dn;
  if (!arguments.covered) return model && model->noise ? model->noise->black_level_dn : 0.0;
  double sum = 0.0;
  int exposures = 0;
  double full_scale = 0.0;
  read_dark(*arguments.covered, arguments, model, [&](const Frame& frame, const cv::Mat& image) {
    sum += cv::mean(image)[0];
    full_scale = frame.full_scale_dn();
    ++exposures;
  });
  if (exposures == 0) {
    throw Error(ErrorKind::kUntrustworthy, "--covered: there is no dark exposure");
  }
  const double level = sum / exposures;
  if (level < 0.25 * full_scale) return level;
  throw Error(ErrorKind::kUntrustworthy,
              fmt::format("--covered: the images are at {:.0f} of {:.0f}: the lens is not covered",
                          level, full_scale));
}

PhotonTransferFit measure(const NoiseArguments& arguments,
                          const std::optional<StriperModel>& model) {
  const double black_dn = black_level(arguments, model);
  PhotonTransfer transfer;
  read_dark(arguments.source, arguments, model, [&](const Frame& frame, const cv::Mat& image) {
    transfer.add(image, frame.full_scale_dn(), static_cast<int>(frame.field));
  });
  return transfer.fit(black_dn);
}

nlohmann::json to_json(const PhotonTransferFit& fit) {
  return {{"read_noise_dn", fit.noise.read_noise_dn},
          {"read_noise_sigma_dn", fit.read_noise_sigma_dn},
          {"dn_per_electron", fit.noise.dn_per_electron},
          {"dn_per_electron_sigma", fit.dn_per_electron_sigma},
          {"black_level_dn", fit.noise.black_level_dn},
          {"bit_depth", fit.noise.bit_depth.value()},
          {"lowest_dn", fit.lowest_dn},
          {"highest_dn", fit.highest_dn},
          {"misfit", fit.misfit},
          {"pictures", fit.pictures}};
}

void report(const NoiseArguments& arguments, const PhotonTransferFit& fit, bool is_black_assumed) {
  say(fmt::format("{} exposures, light from {:.0f} to {:.0f} DN, off the line by {:.1f} %",
                  fit.pictures, fit.lowest_dn, fit.highest_dn, 100.0 * fit.misfit));
  say(fmt::format("read noise {:.3f} +- {:.3f} DN, {:.4f} +- {:.4f} DN per electron",
                  fit.noise.read_noise_dn, fit.read_noise_sigma_dn, fit.noise.dn_per_electron,
                  fit.dn_per_electron_sigma));
  if (is_black_assumed) {
    say("the black level was taken to be 0, and the read noise is only as right as that: "
        "--covered or --black gives it");
  }
  if (arguments.json) {
    print_json(to_json(fit));
  } else if (!arguments.model) {
    fmt::print(
        "noise: {{read_noise_dn: {}, dn_per_electron: {}, black_level_dn: {}, bit_depth: {}}}\n",
        fit.noise.read_noise_dn, fit.noise.dn_per_electron, fit.noise.black_level_dn,
        fit.noise.bit_depth.value());
  }
}

ExitCode noise(const NoiseArguments& arguments) {
  std::optional<StriperModel> model;
  if (arguments.model) {
    model = load_model(*arguments.model, TerminalEvents().port());
    require_writable(arguments.out.value_or(*arguments.model));
  }
  if (arguments.black_dn && !(*arguments.black_dn >= 0.0 && std::isfinite(*arguments.black_dn))) {
    throw Error(ErrorKind::kUsage,
                fmt::format("--black {}: expected a level in DN, 0 or above", *arguments.black_dn));
  }
  const bool is_black_assumed =
      !arguments.black_dn && !arguments.covered && !(model && model->noise);
  const PhotonTransferFit fit = measure(arguments, model);
  if (model) {
    model->noise = fit.noise;
    save_model(*model, arguments.out.value_or(*arguments.model));
  }
  report(arguments, fit, is_black_assumed);
  return ExitCode::kDone;
}

}  // namespace

void add_noise(Command& striper, Action& action) {
  add_command<NoiseArguments>(striper, action, "noise", kDescription, define, noise);
}

}  // namespace striper::program
