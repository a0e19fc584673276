// SPDX-License-Identifier: Apache-2.0
#include "gige/protocol/feature_access.hpp"

#include <charconv>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

namespace striper::detail {
namespace {

struct Free {
  void operator()(void* memory) const noexcept { g_free(memory); }
};

// A camera keeps the nearest value that its registers can hold; further off than this is refused.
constexpr double kRoundingToTell = 1e-3;
constexpr double kRoundingToRefuse = 0.2;

}  // namespace

FeatureAccess::FeatureAccess(ArvDevice* device, std::string device_name, EventPort events)
    : device_(device), device_name_(std::move(device_name)), events_(std::move(events)) {}

bool FeatureAccess::has(const char* name) const {
  ArvGcNode* const node = arv_device_get_feature(device_, name);
  if (!ARV_IS_GC_FEATURE_NODE(node)) return false;
  CallError error;
  return arv_device_is_feature_available(device_, name, error.slot()) != FALSE && !error;
}

const char* FeatureAccess::first_of(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    if (has(name)) return name;
  }
  return nullptr;
}

const char* FeatureAccess::need_one_of(const char* what,
                                       std::initializer_list<const char*> names) const {
  if (const char* const name = first_of(names)) return name;
  throw Error(ErrorKind::kUnsupported,
              fmt::format("{}: this camera cannot set the {}: it has no feature {}", device_name_,
                          what, fmt::join(names, " or ")));
}

void FeatureAccess::refuse(const char* name, const std::string& value,
                           const std::string& allowed) const {
  throw Error(ErrorKind::kUsage,
              fmt::format("{}: {}={} - expected {}", device_name_, name, value, allowed));
}

void FeatureAccess::check(const CallError& error, const char* action, const char* name) const {
  if (!error) return;
  throw Error(ErrorKind::kDevice,
              fmt::format("{}: cannot {} {}: {}", device_name_, action, name, error.message()));
}

void FeatureAccess::set(const char* name, const std::string& value) const {
  ArvGcNode* const node = arv_device_get_feature(device_, name);
  if (!ARV_IS_GC_FEATURE_NODE(node)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{}: this camera has no feature '{}'; `arv-tool-0.8 features` lists "
                            "those that it has",
                            device_name_, name));
  }
  if (!has(name)) {
    throw Error(
        ErrorKind::kUnsupported,
        fmt::format("{}: {} cannot be used in the camera's present mode", device_name_, name));
  }
  if (ARV_IS_GC_COMMAND(node)) return execute(name);
  if (ARV_IS_GC_ENUMERATION(node)) return set_enumeration(name, value);
  if (ARV_IS_GC_BOOLEAN(node)) return set_boolean(name, value);
  if (ARV_IS_GC_FLOAT(node)) return set_number(name, checked_number(name, value));
  if (ARV_IS_GC_INTEGER(node)) {
    const double number = checked_number(name, value);
    if (number != std::floor(number)) refuse(name, value, "a whole number");
    return set_integer(name, static_cast<std::int64_t>(number));
  }
  CallError error;
  arv_device_set_string_feature_value(device_, name, value.c_str(), error.slot());
  check(error, "set", name);
  if (text(name) != value)
    refuse(name, value, fmt::format("a text that it keeps, not '{}'", text(name)));
}

double FeatureAccess::checked_number(const char* name, const std::string& value) const {
  double number = 0.0;
  const char* const last = value.data() + value.size();
  const auto [end, code] = std::from_chars(value.data(), last, number);
  if (code != std::errc() || end != last || !std::isfinite(number)) {
    refuse(name, value, "a number");
  }
  return number;
}

std::optional<std::pair<double, double>> FeatureAccess::find_bounds(const char* name) const {
  CallError error;
  double low = 0.0;
  double high = 0.0;
  if (ARV_IS_GC_FLOAT(arv_device_get_feature(device_, name))) {
    arv_device_get_float_feature_bounds(device_, name, &low, &high, error.slot());
  } else {
    gint64 least = 0;
    gint64 most = 0;
    arv_device_get_integer_feature_bounds(device_, name, &least, &most, error.slot());
    low = static_cast<double>(least);
    high = static_cast<double>(most);
  }
  if (error) return std::nullopt;
  return std::pair{low, high};
}

void FeatureAccess::set_number(const char* name, double value) const {
  if (!ARV_IS_GC_FLOAT(arv_device_get_feature(device_, name))) {
    return set_integer(name, std::llround(value));
  }
  double low = 0.0;
  double high = 0.0;
  CallError error;
  arv_device_get_float_feature_bounds(device_, name, &low, &high, error.slot());
  if (!error && (value < low || value > high)) {
    refuse(name, fmt::format("{}", value), fmt::format("{} to {}", low, high));
  }
  arv_device_set_float_feature_value(device_, name, value, error.slot());
  check(error, "set", name);
  const double kept = number(name);
  const double off = std::abs(kept - value) / std::max(std::abs(value), 1e-12);
  if (off > kRoundingToRefuse && std::abs(kept - value) > 1.0) {
    throw Error(ErrorKind::kDevice,
                fmt::format("{}: {} was set to {} and reads {}", device_name_, name, value, kept));
  }
  if (off > kRoundingToTell) {
    events_.send({"setting_adjusted", fmt::format("{}: {} was set to {}; the camera took {}",
                                                  device_name_, name, value, kept)});
  }
}

void FeatureAccess::write_integer(const char* name, std::int64_t value) const {
  gint64 low = 0;
  gint64 high = 0;
  CallError error;
  arv_device_get_integer_feature_bounds(device_, name, &low, &high, error.slot());
  if (!error) {
    const gint64 step =
        std::max<gint64>(arv_device_get_integer_feature_increment(device_, name, error.slot()), 1);
    if (value < low || value > high || (value - low) % step != 0) {
      refuse(name, fmt::format("{}", value),
             step == 1 ? fmt::format("{} to {}", low, high)
                       : fmt::format("{} to {} in steps of {}", low, high, step));
    }
  }
  arv_device_set_integer_feature_value(device_, name, value, error.slot());
  check(error, "set", name);
}

void FeatureAccess::set_integer(const char* name, std::int64_t value) const {
  write_integer(name, value);
  const std::int64_t kept = integer(name);
  if (kept != value) {
    throw Error(ErrorKind::kDevice,
                fmt::format("{}: {} was set to {} and reads {}", device_name_, name, value, kept));
  }
}

void FeatureAccess::set_enumeration(const char* name, const std::string& value) const {
  if (!has_entry(name, value)) {
    refuse(name, value, fmt::format("one of {}", fmt::join(entries(name), ", ")));
  }
  CallError error;
  arv_device_set_string_feature_value(device_, name, value.c_str(), error.slot());
  check(error, "set", name);
  const std::string kept = text(name);
  if (kept != value) {
    throw Error(ErrorKind::kDevice,
                fmt::format("{}: {} was set to {} and reads {}", device_name_, name, value, kept));
  }
}

void FeatureAccess::set_boolean(const char* name, const std::string& value) const {
  const bool is_true = value == "1" || value == "true" || value == "yes" || value == "on";
  const bool is_false = value == "0" || value == "false" || value == "no" || value == "off";
  if (!is_true && !is_false) refuse(name, value, "yes or no");
  CallError error;
  arv_device_set_boolean_feature_value(device_, name, is_true ? TRUE : FALSE, error.slot());
  check(error, "set", name);
  const bool kept = arv_device_get_boolean_feature_value(device_, name, error.slot()) != FALSE;
  check(error, "read", name);
  if (kept != is_true) {
    throw Error(ErrorKind::kDevice,
                fmt::format("{}: {} was set to {} and reads {}", device_name_, name, value, kept));
  }
}

void FeatureAccess::execute(const char* name) const {
  CallError error;
  arv_device_execute_command(device_, name, error.slot());
  check(error, "execute", name);
}

bool FeatureAccess::try_set(const char* name, const std::string& value) const {
  if (!has(name)) return false;
  if (ARV_IS_GC_ENUMERATION(arv_device_get_feature(device_, name)) && !has_entry(name, value)) {
    return false;
  }
  set(name, value);
  return true;
}

std::int64_t FeatureAccess::integer(const char* name) const {
  CallError error;
  const gint64 value = arv_device_get_integer_feature_value(device_, name, error.slot());
  check(error, "read", name);
  return value;
}

double FeatureAccess::number(const char* name) const {
  if (!ARV_IS_GC_FLOAT(arv_device_get_feature(device_, name))) {
    return static_cast<double>(integer(name));
  }
  CallError error;
  const double value = arv_device_get_float_feature_value(device_, name, error.slot());
  check(error, "read", name);
  return value;
}

std::string FeatureAccess::text(const char* name) const {
  CallError error;
  const char* const value = arv_device_get_string_feature_value(device_, name, error.slot());
  check(error, "read", name);
  return value != nullptr ? value : "";
}

std::optional<std::int64_t> FeatureAccess::find_integer(const char* name) const {
  if (!has(name)) return std::nullopt;
  return integer(name);
}

std::vector<std::string> FeatureAccess::entries(const char* name) const {
  guint count = 0;
  CallError error;
  // The strings belong to the device, the array to us.
  const std::unique_ptr<const char*, Free> names(
      arv_device_dup_available_enumeration_feature_values_as_strings(device_, name, &count,
                                                                     error.slot()));
  check(error, "list the entries of", name);
  return {names.get(), names.get() + count};
}

bool FeatureAccess::has_entry(const char* name, std::string_view entry) const {
  if (!ARV_IS_GC_ENUMERATION(arv_device_get_feature(device_, name))) return false;
  for (const std::string& known : entries(name)) {
    if (known == entry) return true;
  }
  return false;
}

}  // namespace striper::detail
