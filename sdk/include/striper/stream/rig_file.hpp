// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace striper {

/// A head as `rig.yaml` names it.
struct RigHead {
  std::string name;
  std::string source;
  std::filesystem::path model;
  Eigen::Matrix4d T_rig_head = Eigen::Matrix4d::Identity();
  /// Of the scanner, by the names of `scanner_options()`.
  std::map<std::string, std::string, std::less<>> options;
};

struct RigOdometer {
  std::string source;
  double counts_per_m = 0.0;
  int bits = 32;
};

/// What `rig.yaml` says of heads and odometer; its other keys are left to whoever needs them.
struct RigFile {
  std::string name;
  std::vector<RigHead> heads;
  std::optional<RigOdometer> odometer;
};

/// Reads a rig. Relative paths of models, and of sources that are files, are relative to the file.
/// @throws Error{kBadFile} naming file, line, field, value and what was expected; Error{kNotFound,
/// kIo}.
RigFile load_rig(const std::filesystem::path& path);
/// The same from text. @param path stands for the file in messages, and for what is relative to it.
RigFile parse_rig(const std::string& text, const std::filesystem::path& path);

}  // namespace striper
