// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include <striper/pipeline/stripe_survey.hpp>

namespace striper {
namespace {

constexpr std::array kAxes{StripeAxis::kColumns, StripeAxis::kRows};
constexpr std::array kGreyChannels{Channel::kGrey};
// Of equal ones the first is named: a laser's own colour before what mixes several.
constexpr std::array kColourChannels{Channel::kRed,           Channel::kGreen,
                                     Channel::kBlue,          Channel::kGrey,
                                     Channel::kGreenMinusRed, Channel::kRedMinusGreen};

// With a label of its own a frame need not be compared with others to know whether it is lit. Two
// interlaced fields may be lit differently: the pattern tells.
Frame labelled(const Frame& frame, const IlluminationPattern& pattern) {
  Frame copy = frame;
  if (!frame.illumination.is_unknown() || frame.is_interlaced()) return copy;
  copy.illumination =
      pattern.is_automatic() ? Illumination::laser(0) : pattern.at(frame.exposure_number());
  return copy;
}

ScannerOptions options_for(ScannerOptions options, StripeAxis axis, Channel channel) {
  options.stripe.axis = axis;
  options.stripe.expected.clear();
  if (options.mask && !options.mask->metres.empty()) options.mask.reset();  // Of another axis.
  options.ambient.channel = channel;
  options.ambient.difference_channel.reset();
  return options;
}

// Sums up scans of one way to look.
class Tally {
 public:
  Tally(StripeAxis axis, Channel channel) : sighting_{axis, channel} {}

  void add(ScanSpan scans) {
    for (const PolarScan& scan : scans) {
      ++sighting_.scans;
      if (!scan.is_stripe_seen) continue;
      ++sighting_.scans_seen;
      lines_ += scan.returns.size();
      good_ += static_cast<std::size_t>(
          std::count_if(scan.returns.begin(), scan.returns.end(),
                        [](const Return& r) { return r.status == ReturnStatus::kOk; }));
    }
  }

  StripeSighting sighting() const {
    StripeSighting result = sighting_;
    if (lines_ > 0) result.found = static_cast<double>(good_) / static_cast<double>(lines_);
    return result;
  }

 private:
  StripeSighting sighting_;
  std::size_t lines_ = 0;
  std::size_t good_ = 0;
};

StripeSighting look(std::span<const Frame> frames, const ScannerOptions& options) {
  Tally tally(options.stripe.axis, options.ambient.channel);
  Scanner scanner(options);
  for (const Frame& frame : frames) {
    tally.add(scanner.process(labelled(frame, options.ambient.pattern)));
  }
  tally.add(scanner.finish());
  return tally.sighting();
}

}  // namespace

std::vector<StripeSighting> survey_stripes(std::span<const Frame> frames,
                                           const ScannerOptions& options) {
  std::vector<StripeSighting> sightings;
  if (frames.empty()) return sightings;
  const bool has_colour = std::any_of(
      frames.begin(), frames.end(), [](const Frame& frame) { return frame.image.channels() == 3; });
  const std::span<const Channel> channels = has_colour ? std::span<const Channel>(kColourChannels)
                                                       : std::span<const Channel>(kGreyChannels);
  for (const StripeAxis axis : kAxes) {
    for (const Channel channel : channels) {
      sightings.push_back(look(frames, options_for(options, axis, channel)));
    }
  }
  std::stable_sort(sightings.begin(), sightings.end(),
                   [](const auto& one, const auto& other) { return one.found > other.found; });
  return sightings;
}

}  // namespace striper
