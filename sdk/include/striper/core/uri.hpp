// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace striper {

class IlluminationPattern;

/// An address taken apart: `scheme:path?key=value&key=value`.
///
/// The query begins at the last `?` that is followed by `key=`, so that a glob may contain question
/// marks. Values are taken with the functions below; `refuse_unused` then names whatever nobody
/// asked for, so that a misspelt key is an error and never ignored. Which schemes there are, and
/// what a bare path is, is for SourceUri and SinkUri.
class Uri {
 public:
  const std::string& scheme() const noexcept { return scheme_; }
  const std::string& path() const noexcept { return path_; }
  const std::string& text() const noexcept { return text_; }

  /// Returns a value as text, empty where the key is absent, and marks it as used.
  std::optional<std::string> take(const std::string& key);

  /// The same as a number. @throws Error{kUsage} quoting key and value where it is no number or
  /// outside [low, high].
  std::optional<double> take_number(const std::string& key, double low, double high);
  std::optional<long> take_integer(const std::string& key, long low, long high);
  /// `1`, `true`, `yes`, `on` or their opposites.
  std::optional<bool> take_bool(const std::string& key);

  /// Whether a key has a value that says yes, as `take_bool`, without taking it.
  bool says_yes(const std::string& key) const;

  /// Gives a key a value where the address has none.
  void set_default(const std::string& key, const std::string& value);

  /// @throws Error{kUsage} naming the keys that nobody took and, after them, `known`: those that
  /// exist.
  void refuse_unused(std::string_view known) const;

  /// Everything not yet taken: for sources whose keys are the device's own (GenICam, V4L2
  /// controls).
  std::map<std::string, std::string> take_rest();

 protected:
  /// Takes the query apart; scheme and path are the heir's to set.
  /// @param what "source" or "sink", for messages.
  /// @throws Error{kUsage} on a query that is none, or a key that is given twice.
  Uri(const char* what, std::string_view text);

  /// What stands before the query.
  std::string_view address() const noexcept;
  /// The word before the first colon of an address; empty where it is none.
  static std::string_view scheme_word(std::string_view address) noexcept;

  std::string scheme_;
  std::string path_;

 private:
  const char* what_;
  std::string text_;
  std::map<std::string, std::string> parameters_;
  std::set<std::string> used_;
};

/// Takes `laser=`, which every source knows; empty where it is absent.
/// @throws Error{kUsage} quoting source and value where that is no pattern.
std::optional<IlluminationPattern> take_pattern(Uri& uri);

}  // namespace striper
