// SPDX-License-Identifier: Apache-2.0
#include "model/stripe_block.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace striper::detail {
namespace {

constexpr std::string_view kAxes = "columns or rows";
constexpr std::string_view kChannels = "auto, grey, red, green, blue, green-red or red-green";

// What a person's three rounded digits may be off a sum of 1.
constexpr double kShareTolerance = 1e-3;

Channel read_channel(const YamlField& field) {
  const auto channel = channel_from_string(field.word(kChannels));
  if (!channel) field.refuse(kChannels);
  return *channel;
}

// A range and what the stripe is there.
using Knot = std::pair<double, double>;

std::vector<Knot> read_knots(const YamlField& field) {
  std::vector<Knot> knots;
  for (const YamlField& entry : field.list()) {
    const Eigen::VectorXd pair = entry.numbers(2);
    knots.emplace_back(pair[0], pair[1]);
  }
  return knots;
}

StripeLook read_look(const YamlField& field) {
  field.require_map({"width_px", "width_at", "amplitude_at", "colour"});
  StripeLook look;
  if (const auto width = field.find("width_px")) look.width_px = width->number();
  if (const auto widths = field.find("width_at")) {
    for (const Knot& knot : read_knots(*widths)) look.width_at.push_back({knot.first, knot.second});
  }
  if (const auto amplitudes = field.find("amplitude_at")) {
    for (const Knot& knot : read_knots(*amplitudes)) {
      look.amplitude_at.push_back({knot.first, knot.second});
    }
  }
  if (const auto colour = field.find("colour")) {
    const Eigen::VectorXd shares = colour->numbers(3);
    look.colour = std::array<double, 3>{shares[0], shares[1], shares[2]};
  }
  return look;
}

std::vector<Knot> widths_of(const StripeLook& look) {
  std::vector<Knot> knots;
  for (const auto& at : look.width_at) knots.emplace_back(at.range_m, at.width_px);
  return knots;
}

std::vector<Knot> amplitudes_of(const StripeLook& look) {
  std::vector<Knot> knots;
  for (const auto& at : look.amplitude_at) knots.emplace_back(at.range_m, at.amplitude_dn);
  return knots;
}

std::string knots_text(const std::vector<Knot>& knots) {
  std::vector<std::string> pairs;
  pairs.reserve(knots.size());
  for (const Knot& knot : knots) pairs.push_back(fmt::format("[{}, {}]", knot.first, knot.second));
  return fmt::format("[{}]", fmt::join(pairs, ", "));
}

std::string look_text(const StripeLook& look) {
  std::vector<std::string> fields;
  if (look.width_px) fields.push_back(fmt::format("width_px: {}", *look.width_px));
  if (!look.width_at.empty()) fields.push_back("width_at: " + knots_text(widths_of(look)));
  if (!look.amplitude_at.empty()) {
    fields.push_back("amplitude_at: " + knots_text(amplitudes_of(look)));
  }
  if (look.colour) fields.push_back(fmt::format("colour: [{}]", fmt::join(*look.colour, ", ")));
  if (fields.empty()) return "    - {}\n";
  return fmt::format("    - {}\n", fmt::join(fields, "\n      "));
}

bool is_empty(const StripeLook& look) {
  return !look.width_px && look.width_at.empty() && look.amplitude_at.empty() && !look.colour;
}

bool is_positive(double value) { return std::isfinite(value) && value > 0.0; }

std::optional<Violation> check_knots(const std::vector<Knot>& knots, const std::string& field,
                                     std::string_view unit) {
  if (knots.size() == 1) {
    return Violation{field, "one pair", "a course over range: none, or two pairs and more"};
  }
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const std::string here = fmt::format("{}[{}]", field, i);
    if (!is_positive(knots[i].first) || !is_positive(knots[i].second)) {
      return Violation{here, fmt::format("[{}, {}]", knots[i].first, knots[i].second),
                       fmt::format("a range in metres and {}, both above 0", unit)};
    }
    if (i > 0 && !(knots[i].first > knots[i - 1].first)) {
      return Violation{here, fmt::format("range {} after {}", knots[i].first, knots[i - 1].first),
                       "ranges that rise"};
    }
  }
  return std::nullopt;
}

std::optional<Violation> check_colour(const std::array<double, 3>& colour,
                                      const std::string& field) {
  const auto is_share = [](double share) { return std::isfinite(share) && share >= 0.0; };
  const double sum = colour[0] + colour[1] + colour[2];
  if (std::all_of(colour.begin(), colour.end(), is_share) &&
      std::abs(sum - 1.0) <= kShareTolerance) {
    return std::nullopt;
  }
  return Violation{field, fmt::format("[{}]", fmt::join(colour, ", ")),
                   "shares of blue, green and red, each 0 or more, whose sum is 1"};
}

}  // namespace

void read_stripe(const YamlField& field, StriperModel& model) {
  field.require_map({"axis", "channel", "difference_channel", "lasers"});
  const YamlField axis = field.at("axis", kAxes);
  const auto axis_value = stripe_axis_from_string(axis.word(kAxes));
  if (!axis_value) axis.refuse(kAxes);
  model.axis = *axis_value;
  model.channel = read_channel(field.at("channel", kChannels));
  if (const auto channel = field.find("difference_channel")) {
    model.difference_channel = read_channel(*channel);
  }
  const auto looks = field.find("lasers");
  if (!looks) return;
  const std::vector<YamlField> entries = looks->list();
  if (entries.size() > model.lasers.size()) {
    looks->refuse(fmt::format("at most {}, as there are lasers", model.lasers.size()));
  }
  for (std::size_t i = 0; i < entries.size(); ++i) model.lasers[i].look = read_look(entries[i]);
}

std::string stripe_text(const StriperModel& model) {
  const std::string difference =
      model.difference_channel
          ? fmt::format("difference_channel: {}", to_string(*model.difference_channel))
          : std::string();
  const auto last = std::find_if(model.lasers.rbegin(), model.lasers.rend(),
                                 [](const Laser& laser) { return !is_empty(laser.look); });
  if (last == model.lasers.rend()) {
    return fmt::format("stripe: {{axis: {}, channel: {}{}{}}}\n", to_string(model.axis),
                       to_string(model.channel), difference.empty() ? "" : ", ", difference);
  }
  std::string text = fmt::format("stripe:\n  axis: {}\n  channel: {}\n", to_string(model.axis),
                                 to_string(model.channel));
  if (!difference.empty()) text += fmt::format("  {}\n", difference);
  text +=
      "  # What the stripe of each laser looks like: width_px is its Gaussian sigma, width_at its\n"
      "  # course as [range_m, width_px]; amplitude_at is [range_m, DN] on white paper that faces\n"
      "  # the laser; colour is its light's shares of blue, green and red.\n"
      "  lasers:\n";
  std::for_each(model.lasers.begin(), last.base(),
                [&](const Laser& laser) { text += look_text(laser.look); });
  return text;
}

std::optional<Violation> check_look(const StripeLook& look, std::size_t laser) {
  const std::string field = fmt::format("stripe.lasers[{}].", laser);
  if (look.width_px && !is_positive(*look.width_px)) {
    return Violation{field + "width_px", fmt::format("{}", *look.width_px),
                     "a number of pixels above 0"};
  }
  if (auto bad = check_knots(widths_of(look), field + "width_at", "a width in pixels")) return bad;
  if (auto bad = check_knots(amplitudes_of(look), field + "amplitude_at", "an amplitude in DN")) {
    return bad;
  }
  return look.colour ? check_colour(*look.colour, field + "colour") : std::nullopt;
}

}  // namespace striper::detail
