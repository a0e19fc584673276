// SPDX-License-Identifier: Apache-2.0
#include "scene/scene_field.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

constexpr std::size_t kLongestQuote = 60;

std::string quote(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  std::string text;
  if (node.IsScalar()) {
    text = node.Scalar();
  } else {
    YAML::Emitter flow;
    flow << YAML::Flow << node;
    text = flow.c_str();
    std::replace(text.begin(), text.end(), '\n', ' ');
  }
  if (text.size() > kLongestQuote) text = text.substr(0, kLongestQuote) + "...";
  return fmt::format("'{}'", text);
}

bool parse_number(const YAML::Node& node, double& number) {
  if (!node.IsScalar()) return false;
  const std::string& text = node.Scalar();
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  return error == std::errc() && end == last && std::isfinite(number);
}

}  // namespace

std::string SceneField::place() const {
  const YAML::Mark mark = node_.Mark();
  return mark.is_null() ? fmt::format("scene '{}'", file_)
                        : fmt::format("scene '{}' line {}", file_, mark.line + 1);
}

void SceneField::refuse(std::string_view expected) const {
  throw Error(ErrorKind::kBadFile,
              fmt::format("{}: {}: {} - expected {}", place(), path_.empty() ? "the file" : path_,
                          quote(node_), expected));
}

void SceneField::require_map(std::initializer_list<std::string_view> known) const {
  if (!node_.IsMap()) refuse(fmt::format("a block with {}", fmt::join(known, ", ")));
  std::vector<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    const SceneField field(entry.second, path_.empty() ? key : path_ + "." + key, file_);
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      throw Error(
          ErrorKind::kBadFile,
          fmt::format("{}: unknown key '{}'; {} {}", field.place(), field.path_,
                      path_.empty() ? "a scene knows" : "here are known", fmt::join(known, ", ")));
    }
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) {
      throw Error(ErrorKind::kBadFile,
                  fmt::format("{}: {} is given twice", field.place(), field.path_));
    }
    seen.push_back(key);
  }
}

std::optional<SceneField> SceneField::find(std::string_view key) const {
  const YAML::Node value = node_[std::string(key)];
  if (!value.IsDefined()) return std::nullopt;
  return SceneField(value, path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key),
                    file_);
}

SceneField SceneField::at(std::string_view key, std::string_view expected) const {
  if (auto value = find(key)) return *std::move(value);
  throw Error(ErrorKind::kBadFile, fmt::format("{}: {}{}{} is missing - expected {}", place(),
                                               path_, path_.empty() ? "" : ".", key, expected));
}

std::vector<SceneField> SceneField::list(std::string_view expected) const {
  if (!node_.IsSequence()) refuse(expected);
  std::vector<SceneField> elements;
  for (std::size_t i = 0; i < node_.size(); ++i) {
    elements.emplace_back(node_[i], fmt::format("{}[{}]", path_, i), file_);
  }
  return elements;
}

SceneField SceneField::nearest(std::string_view path) const {
  const std::size_t end = std::min(path.find('.'), path.size());
  const std::string_view step = path.substr(0, end);
  const std::size_t bracket = std::min(step.find('['), step.size());
  if (!node_.IsMap()) return *this;
  auto field = find(step.substr(0, bracket));
  if (!field) return *this;
  if (bracket < step.size()) {
    std::size_t index = 0;
    std::from_chars(step.data() + bracket + 1, step.data() + step.size(), index);
    const std::vector<SceneField> elements = field->list("a list");
    if (index >= elements.size()) return *field;
    field = elements[index];
  }
  return end < path.size() ? field->nearest(path.substr(end + 1)) : *field;
}

double SceneField::number(std::string_view expected) const {
  double value = 0.0;
  if (!parse_number(node_, value)) refuse(expected);
  return value;
}

bool SceneField::yes_or_no() const {
  bool value = false;
  if (!node_.IsScalar() || !YAML::convert<bool>::decode(node_, value)) refuse("yes or no");
  return value;
}

std::string SceneField::word(std::string_view expected) const {
  if (!node_.IsScalar()) refuse(expected);
  return node_.Scalar();
}

std::vector<double> SceneField::all_numbers(std::string_view expected) const {
  if (!node_.IsSequence()) refuse(expected);
  std::vector<double> values;
  for (const auto& element : node_) {
    if (!parse_number(element, values.emplace_back())) refuse(expected);
  }
  return values;
}

Eigen::VectorXd SceneField::numbers(int count, std::string_view expected) const {
  const std::vector<double> values = all_numbers(expected);
  if (static_cast<int>(values.size()) != count) refuse(expected);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), count);
}

void SceneField::read(std::string_view key, double& value, double scale) const {
  if (const auto field = find(key)) value = scale * field->number();
}

void SceneField::read(std::string_view key, int& value) const {
  const auto field = find(key);
  if (!field) return;
  const double number = field->number("a whole number");
  constexpr double kLargest = 1e9;
  if (number != std::floor(number) || std::abs(number) > kLargest) field->refuse("a whole number");
  value = static_cast<int>(number);
}

void SceneField::read(std::string_view key, bool& value) const {
  if (const auto field = find(key)) value = field->yes_or_no();
}

void SceneField::read(std::string_view key, Eigen::Vector3d& value, double scale) const {
  if (const auto field = find(key)) value = scale * field->numbers(3, "three numbers [x, y, z]");
}

}  // namespace striper::detail
