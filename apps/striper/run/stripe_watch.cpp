// SPDX-License-Identifier: Apache-2.0
#include "run/stripe_watch.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "program/terminal.hpp"

namespace striper::program {
namespace {

// So many scans tell a laser that is off from one that is not yet on in the first of them.
constexpr std::uint64_t kFirstScans = 3;
// Two lit exposures with the dark ones around them, which is what a survey subtracts; their pixels
// are copied, so few.
constexpr std::size_t kFramesKept = 5;
// Of the scan lines: an edge of a wall or a post that the extractor takes for a stripe along the
// other axis is shorter than a laser's fan, which is made to fill the view.
constexpr double kLeastFound = 0.25;

double percent(std::uint64_t of, std::uint64_t all) {
  return 100.0 * static_cast<double>(of) / static_cast<double>(std::max<std::uint64_t>(all, 1));
}

}  // namespace

std::optional<StripeSighting> best_sighting(std::span<const Frame> frames,
                                            const ScannerOptions& options) {
  for (const StripeSighting& one : survey_stripes(frames, options)) {
    if (one.is_seen() && one.found >= kLeastFound) return one;
  }
  return std::nullopt;
}

std::string describe(const StripeSighting& sighting) {
  const std::string_view lines = to_string(sighting.axis);
  return fmt::format("a stripe along {} in channel {} is seen in {:.0f} % of the {}", lines,
                     to_string(sighting.channel), 100.0 * sighting.found, lines);
}

std::string options_for(const StripeSighting& sighting, const ScannerOptions& tried) {
  const Channel channel = tried.ambient.channel;
  const bool is_grey_default = channel == Channel::kAuto && sighting.channel == Channel::kGrey;
  std::string text;
  if (sighting.axis != tried.stripe.axis) text = fmt::format("--axis {}", to_string(sighting.axis));
  if (sighting.channel != channel && !is_grey_default) {
    text += fmt::format("{}--channel {}", text.empty() ? "" : " ", to_string(sighting.channel));
  }
  return text;
}

void KeptFrames::keep(const Frame& frame) {
  if (frames_.size() >= kFramesKept || frame.status != FrameStatus::kOk) return;
  frames_.push_back(frame);
  frames_.back().image = frame.image.clone();
  frames_.back().lease.reset();
}

StripeWatch::StripeWatch(const ScannerArguments& arguments, const ScannerSetup& setup)
    : options_(setup.options), search_(describe_search(arguments, setup)) {
  say("looking for the stripe " + search_);
}

void StripeWatch::keep(const Frame& frame) {
  if (!has_spoken_ && scans_ == without_stripe_) kept_.keep(frame);
}

void StripeWatch::look_at(ScanSpan scans) {
  for (const PolarScan& scan : scans) {
    ++scans_;
    if (!scan.is_stripe_seen) ++without_stripe_;
  }
  const bool is_any_seen = scans_ > without_stripe_;
  if (is_any_seen) return kept_.forget();
  if (scans_ >= kFirstScans && !has_spoken_) say_where_it_is();
}

void StripeWatch::say_where_it_is() {
  has_spoken_ = true;
  say(
      fmt::format("no_stripe: no laser's stripe in the first {}, looked for {}: is the laser on, "
                  "and in view?",
                  count(scans_, "scan"), search_));
  elsewhere_ = best_sighting(kept_.frames(), options_);
  kept_.forget();
  if (!elsewhere_) return say("no_stripe: nor along the other axis, nor in any other channel");
  const std::string options = options_for(*elsewhere_, options_);
  say(fmt::format("no_stripe: {}: {}", describe(*elsewhere_),
                  options.empty()
                      ? "where the model has none: is it this striper's, the plane's sign right?"
                      : options));
}

void StripeWatch::conclude() {
  if (without_stripe_ == 0) return;
  if (scans_ == without_stripe_ && !has_spoken_) say_where_it_is();
  say(fmt::format("no_stripe: in {} of {} ({:.0f} %) no stripe was seen", without_stripe_,
                  count(scans_, "scan"), percent(without_stripe_, scans_)));
}

void StripeWatch::add_to(nlohmann::json& summary) const {
  summary["without_stripe"] = without_stripe_;
  summary["stripe_elsewhere"] = nullptr;
  if (!elsewhere_) return;
  summary["stripe_elsewhere"] = {{"axis", to_string(elsewhere_->axis)},
                                 {"channel", to_string(elsewhere_->channel)},
                                 {"found", elsewhere_->found}};
}

}  // namespace striper::program
