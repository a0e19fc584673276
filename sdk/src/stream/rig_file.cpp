// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/pipeline/scanner_option.hpp>
#include <striper/stream/rig_file.hpp>

#include "core/yaml_field.hpp"

namespace striper {
namespace {

namespace fs = std::filesystem;
using detail::YamlField;

fs::path beside(const fs::path& rig, const std::string& path) {
  return fs::path(path).is_absolute() ? fs::path(path) : rig.parent_path() / path;
}

// Of sources only those of files are relative to anything.
std::string source_beside(const fs::path& rig, const std::string& source) {
  for (const std::string scheme : {"sim:", "images:", "mcap:"}) {
    if (source.starts_with(scheme)) {
      return scheme + beside(rig, source.substr(scheme.size())).string();
    }
  }
  const bool has_scheme = source.find(':') != std::string::npos;
  return has_scheme ? source : beside(rig, source).string();
}

// A turn and a shift: the last row and the rotation's orthogonality are looked at.
Eigen::Matrix4d read_pose(const YamlField& field) {
  constexpr double kOff = 1e-6;
  Eigen::Matrix4d pose = field.matrix(4, 4, "a pose, head to rig");
  const Eigen::Matrix3d turn = pose.topLeftCorner<3, 3>();
  const bool is_pose = (turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() < kOff &&
                       turn.row(0).cross(turn.row(1)).dot(turn.row(2)) > 0.0 &&
                       (pose.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() < kOff;
  if (!is_pose) field.refuse("a rotation and a translation");
  return pose;
}

void read_option(const YamlField& options, const std::string& key, RigHead& head) {
  const ScannerOption* const option = find_scanner_option(key);
  if (option == nullptr)
    options.refuse(key, "an option of the scanner, as the command line has it");
  const YamlField value = options.at(key, option->form);
  const std::string text = value.word(option->form);
  ScannerOptions tried;
  try {
    set_scanner_option(tried, option->name, text);
  } catch (const Error& error) {
    value.refuse(error.what());
  }
  head.options[std::string(option->name)] = text;
}

RigHead read_head(const YamlField& field, const fs::path& rig) {
  field.require_map({"name", "source", "model", "T_rig_head", "options"});
  RigHead head;
  const YamlField name = field.at("name", "the head's name");
  head.name = name.word("the head's name");
  if (head.name.empty()) name.refuse("a name");
  head.source =
      source_beside(rig, field.at("source", "where its frames come from").word("a source"));
  head.model = beside(rig, field.at("model", "its model's file").word("a file"));
  if (const auto pose = field.find("T_rig_head")) head.T_rig_head = read_pose(*pose);
  const auto options = field.find("options");
  if (!options) return head;
  if (!options->node().IsMap()) options->refuse("a map of the scanner's options");
  for (const auto& one : options->node()) read_option(*options, one.first.Scalar(), head);
  return head;
}

RigOdometer read_odometer(const YamlField& field) {
  field.require_map({"source", "counts_per_m", "bits"});
  RigOdometer odometer;
  odometer.source = field.at("source", "where its counts come from").word("an address");
  const YamlField counts = field.at("counts_per_m", "counts for each metre");
  odometer.counts_per_m = counts.number();
  if (odometer.counts_per_m == 0.0) counts.refuse("a number that is not 0");
  const auto bits = field.find("bits");
  if (!bits) return odometer;
  odometer.bits = bits->whole("8, 16 or 32");
  if (odometer.bits != 8 && odometer.bits != 16 && odometer.bits != 32) {
    bits->refuse("8, 16 or 32");
  }
  return odometer;
}

}  // namespace

RigFile parse_rig(const std::string& text, const fs::path& path) {
  const YamlField root = YamlField::parse(text, {path.string(), {}, detail::UnknownKeys::kRefuse});
  root.require_map({"striper_rig", "name", "heads", "T_vehicle_rig", "odometer", "schedule", "to",
                    "covariance"});
  root.at("striper_rig", "1, the version").whole(1, 1, "the version of the file");
  RigFile rig;
  if (const auto name = root.find("name")) rig.name = name->word("the rig's name");
  for (const YamlField& field : root.at("heads", "a list of heads").list()) {
    RigHead head = read_head(field, path);
    const bool is_there = std::any_of(rig.heads.begin(), rig.heads.end(),
                                      [&](const RigHead& one) { return one.name == head.name; });
    if (is_there) field.at("name", "a name").refuse("a name that no other head has");
    rig.heads.push_back(std::move(head));
  }
  if (rig.heads.empty()) root.at("heads", "a list of heads").refuse("one head or more");
  if (const auto odometer = root.find("odometer")) rig.odometer = read_odometer(*odometer);
  return rig;
}

RigFile load_rig(const fs::path& path) { return parse_rig(read_text_file(path, "a rig"), path); }

}  // namespace striper
