// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <striper/core/event.hpp>

#include "gige/protocol/arv_ptr.hpp"

namespace striper::detail {

/// Reads and writes the GenICam features of one device by name. Every write is checked against what
/// the device allows, and read back; every error quotes the device, the feature, the value and the
/// names or the range that are allowed. Not thread-safe.
class FeatureAccess {
 public:
  /// @param device_name for messages. The device must outlive this object.
  /// @param events hears of values that the device changed.
  FeatureAccess(ArvDevice* device, std::string device_name, EventPort events);

  /// True where the device has the feature and it can be used now.
  bool has(const char* name) const;

  /// The first of the names that the device has: features were renamed in the course of time
  /// (ExposureTimeAbs became ExposureTime). nullptr if it has none.
  const char* first_of(std::initializer_list<const char*> names) const;

  /// The same. @throws Error{kUnsupported} naming `what` and the names that were tried.
  const char* need_one_of(const char* what, std::initializer_list<const char*> names) const;

  /// Sets any kind of feature from text: a number, an enumeration's entry, yes/no, or nothing for
  /// a command. @throws Error{kUsage} quoting what is allowed, Error{kDevice} where the device
  /// refuses or does not keep the value.
  void set(const char* name, const std::string& value) const;

  void set_number(const char* name, double value) const;
  void set_integer(const char* name, std::int64_t value) const;

  /// The same for a feature that cannot be read.
  void write_integer(const char* name, std::int64_t value) const;

  void execute(const char* name) const;

  /// Where the device has the feature and the value; false, with no effect, where it has not.
  bool try_set(const char* name, const std::string& value) const;

  std::int64_t integer(const char* name) const;
  double number(const char* name) const;
  std::string text(const char* name) const;
  std::optional<std::int64_t> find_integer(const char* name) const;

  /// What a number can be set to now: least and most; empty where the device does not say.
  std::optional<std::pair<double, double>> find_bounds(const char* name) const;

  /// Entries of an enumeration that can be chosen now.
  std::vector<std::string> entries(const char* name) const;
  bool has_entry(const char* name, std::string_view entry) const;

  ArvDevice* device() const noexcept { return device_; }
  const std::string& device_name() const noexcept { return device_name_; }
  const EventPort& events() const noexcept { return events_; }

 private:
  void set_enumeration(const char* name, const std::string& value) const;
  void set_boolean(const char* name, const std::string& value) const;
  double checked_number(const char* name, const std::string& value) const;
  [[noreturn]] void refuse(const char* name, const std::string& value,
                           const std::string& allowed) const;
  void check(const CallError& error, const char* action, const char* name) const;

  ArvDevice* device_;
  std::string device_name_;
  EventPort events_;
};

}  // namespace striper::detail
