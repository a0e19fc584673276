// SPDX-License-Identifier: Apache-2.0
#include "capture/common_keys.hpp"

#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

Field parse_fields(const SourceUri& uri, const std::string& word) {
  if (word == "split-top") return Field::kInterlacedTopFirst;
  if (word == "split-bottom") return Field::kInterlacedBottomFirst;
  throw Error(ErrorKind::kUsage,
              fmt::format("source '{}': fields={} - expected split-top or split-bottom (the field "
                          "that is exposed first)",
                          uri.text(), word));
}

}  // namespace

CommonKeys CommonKeys::take(SourceUri& uri) {
  CommonKeys keys;
  if (const auto laser = take_pattern(uri)) keys.pattern = *laser;
  if (const auto word = uri.take("fields")) keys.fields = parse_fields(uri, *word);
  return keys;
}

void CommonKeys::apply(SourceInfo& info) const {
  if (!pattern.is_automatic()) info.pattern = pattern;
  if (fields) info.field = *fields;
}

void CommonKeys::apply(Frame& frame, std::int64_t frame_period_ns) const {
  const bool is_one_field = frame.field == Field::kTop || frame.field == Field::kBottom;
  if (fields && !is_one_field) {
    frame.field = *fields;
    frame.exposures_per_picture = 2;
    frame.exposure_in_picture = 0;
    frame.field_period_ns = frame_period_ns / 2;
  }
  if (!pattern.is_automatic()) frame.illumination = Illumination::unknown();
  if (pattern.is_bracket()) {
    frame.exposure_ns = std::llround(1e3 * pattern.exposure_us_at(frame.exposure_number()));
  }
}

}  // namespace striper::detail
