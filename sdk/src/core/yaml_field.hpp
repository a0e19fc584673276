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

/// Models of other versions have other keys; a key that a scene does not know is a mistake.
enum class UnknownKeys { kWarn, kRefuse };

/// A YAML file as its fields know it.
struct YamlFile {
  std::string name;
  EventPort events;  ///< Hears of unknown keys, where they are not refused.
  UnknownKeys unknown_keys = UnknownKeys::kWarn;
};

/// One value of a YAML file that knows where it stands, so that every refusal reads
/// `FILE:LINE: field.path: value - expected ...`. All refusals are Error{kBadFile}.
class YamlField {
 public:
  /// The whole document, as parse_yaml takes it.
  static YamlField parse(const std::string& text, YamlFile file);

  /// Checks that this is a map, refuses a key that is there twice, and warns of keys that are none
  /// of `known` or refuses them, naming the nearest one.
  void require_map(std::initializer_list<std::string_view> known) const;

  /// The value of a key; refused where there is none. @param expected what the key should hold.
  YamlField at(std::string_view key, std::string_view expected) const;
  std::optional<YamlField> find(std::string_view key) const;

  /// The elements of a list; refused where this is none or has another number of them.
  std::vector<YamlField> list(std::optional<std::size_t> count = std::nullopt,
                              std::string_view expected = {}) const;

  double number(std::string_view expected = "a finite number") const;
  /// @param meaning what the number is, for the message where it is not.
  int whole(int low, int high, std::string_view meaning = {}) const;
  int whole(std::string_view expected = "a whole number") const;
  bool yes_or_no() const;
  std::string word(std::string_view expected) const;
  Eigen::VectorXd numbers(std::size_t count, std::string_view expected = {}) const;

  /// A `{rows: r, cols: c, data: [...]}` block of this very size, row-major.
  Eigen::MatrixXd matrix(int rows, int cols, std::string_view meaning = {}) const;

  // Put the value of a key where it belongs; leave what is there where the key is missing.
  void read(std::string_view key, double& value, double scale = 1.0) const;
  void read(std::string_view key, int& value) const;
  void read(std::string_view key, bool& value) const;
  void read(std::string_view key, Eigen::Vector3d& value, double scale = 1.0) const;

  [[noreturn]] void refuse(std::string_view expected) const;
  [[noreturn]] void refuse(std::string_view value, std::string_view expected) const;

  /// The field under a path such as `lasers[0].normal`, or as far down as the path leads.
  YamlField descend(std::string_view path) const;

  const YAML::Node& node() const noexcept { return node_; }
  const std::string& path() const noexcept { return path_; }
  std::string where() const;  ///< `FILE:LINE`.
  const EventPort& events() const noexcept { return file_->events; }

 private:
  YamlField(const YAML::Node& node, std::string path, std::shared_ptr<const YamlFile> file);

  std::string child_path(std::string_view key) const;
  std::string described() const;
  void take_unknown(const YamlField& key, std::initializer_list<std::string_view> known) const;

  YAML::Node node_;
  std::string path_;
  std::shared_ptr<const YamlFile> file_;
};

}  // namespace striper::detail
