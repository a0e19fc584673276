// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <yaml-cpp/yaml.h>

#include <striper/core/event.hpp>

namespace striper::detail {

/// One value of a YAML file that knows where it stands, so that every refusal reads
/// `FILE:LINE: field.path: value - expected ...`. All refusals are Error{kBadFile}.
class YamlField {
 public:
  YamlField(const YAML::Node& node, std::string path, std::shared_ptr<const std::string> file,
            EventPort events = {});

  /// Checks that this is a map, refuses a key that is there twice, and sends `unknown_key` of keys
  /// that are none of `known`, naming the nearest one.
  void require_map(std::initializer_list<std::string_view> known) const;

  /// The value of a key; refused where there is none. @param expected what the key should hold.
  YamlField at(std::string_view key, std::string_view expected) const;
  std::optional<YamlField> find(std::string_view key) const;

  /// The elements of a list; refused where this is none or has another number of them.
  std::vector<YamlField> list(std::optional<std::size_t> count = std::nullopt) const;

  double number(std::string_view expected = "a finite number") const;
  /// @param meaning what the number is, for the message where it is not.
  int whole(int low, int high, std::string_view meaning = {}) const;
  std::string word(std::string_view expected) const;
  Eigen::VectorXd numbers(std::size_t count) const;

  /// A `{rows: r, cols: c, data: [...]}` block of this very size, row-major.
  Eigen::MatrixXd matrix(int rows, int cols, std::string_view meaning = {}) const;

  [[noreturn]] void refuse(std::string_view expected) const;
  [[noreturn]] void refuse(std::string_view value, std::string_view expected) const;

  /// The field under a path such as `lasers[0].normal`, or as far down as the path leads.
  YamlField descend(std::string_view path) const;

  const YAML::Node& node() const noexcept { return node_; }
  std::string where() const;  ///< `FILE:LINE`.
  const EventPort& events() const noexcept { return events_; }

 private:
  std::string child_path(std::string_view key) const;
  std::string described() const;

  YAML::Node node_;
  std::string path_;
  std::shared_ptr<const std::string> file_;
  EventPort events_;
};

/// Parses one YAML document, without aliases, which no file of ours needs.
/// @throws Error{kBadFile} with file and line.
YAML::Node parse_yaml(const std::string& text, const std::string& file);

/// A value for a message: in quotes, cut to a sensible length, control characters escaped.
std::string quoted(std::string_view text);

}  // namespace striper::detail
