// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <yaml-cpp/yaml.h>

namespace striper::detail {

/// One value of a scene file with its place in it: reads it as what it should be, or refuses it
/// with `scene 'FILE' line N: path.to.field: value - expected ...`. All is Error{kBadFile}.
class SceneField {
 public:
  SceneField(const YAML::Node& node, std::string path, std::string file)
      : node_(node), path_(std::move(path)), file_(std::move(file)) {}

  /// Refuses what is no map, and any key that is not among `known`.
  void require_map(std::initializer_list<std::string_view> known) const;

  std::optional<SceneField> find(std::string_view key) const;
  /// Like `find`, but refuses the map where the key is missing. @param expected what it would hold.
  SceneField at(std::string_view key, std::string_view expected) const;
  std::vector<SceneField> list(std::string_view expected) const;

  double number(std::string_view expected = "a number") const;
  bool yes_or_no() const;
  std::string word(std::string_view expected) const;
  Eigen::VectorXd numbers(int count, std::string_view expected) const;
  std::vector<double> all_numbers(std::string_view expected) const;

  // Puts the value of a key where it belongs; leaves the default where the key is missing.
  void read(std::string_view key, double& value, double scale = 1.0) const;
  void read(std::string_view key, int& value) const;
  void read(std::string_view key, bool& value) const;
  void read(std::string_view key, Eigen::Vector3d& value, double scale = 1.0) const;

  [[noreturn]] void refuse(std::string_view expected) const;

  const std::string& path() const noexcept { return path_; }

  /// What `path` leads to from here, as in `lasers[0].fan_deg`, or what the file has of the way.
  SceneField nearest(std::string_view path) const;
  /// `scene 'FILE' line N`.
  std::string place() const;

 private:
  YAML::Node node_;
  std::string path_;
  std::string file_;
};

}  // namespace striper::detail
