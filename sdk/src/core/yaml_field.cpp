// SPDX-License-Identifier: Apache-2.0
#include "core/yaml_field.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

#include "core/yaml_document.hpp"

namespace striper::detail {
namespace {

// Longer words are not compared.
constexpr std::size_t kLongestWord = 64;

// Number of letters to insert, delete or replace to make one word of the other (Levenshtein 1966).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::string hint(std::string_view word, std::initializer_list<std::string_view> known) {
  if (word.size() > kLongestWord) return {};
  const auto* const nearest =
      std::min_element(known.begin(), known.end(), [word](std::string_view a, std::string_view b) {
        return edit_distance(word, a) < edit_distance(word, b);
      });
  if (nearest == known.end() || edit_distance(word, *nearest) > 1 + nearest->size() / 3) return {};
  return fmt::format("; did you mean '{}'?", *nearest);
}

bool is_plain_scalar(const YAML::Node& node) { return node.IsScalar() && node.Tag() == "?"; }

template <typename Number>
std::optional<Number> parse_whole_text(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

YamlField::YamlField(const YAML::Node& node, std::string path, std::shared_ptr<const YamlFile> file)
    : node_(node), path_(std::move(path)), file_(std::move(file)) {}

YamlField YamlField::parse(const std::string& text, YamlFile file) {
  const YAML::Node document = parse_yaml(text, file.name);
  return {document, "", std::make_shared<const YamlFile>(std::move(file))};
}

std::string YamlField::where() const { return yaml_place(file_->name, node_.Mark()); }

std::string YamlField::child_path(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

std::string YamlField::described() const {
  switch (node_.Type()) {
    case YAML::NodeType::Scalar:
      return in_quotes(node_.Scalar()) + (is_plain_scalar(node_) ? "" : " in quotes");
    case YAML::NodeType::Sequence:
      return fmt::format("a list of {}", node_.size());
    case YAML::NodeType::Map:
      return fmt::format("a map of {}", node_.size());
    default:
      return "empty";
  }
}

void YamlField::refuse(std::string_view expected) const { refuse(described(), expected); }

void YamlField::refuse(std::string_view value, std::string_view expected) const {
  const std::string_view field = path_.empty() ? "the file" : std::string_view(path_);
  throw Error(ErrorKind::kBadFile,
              fmt::format("{}: {}: {} - expected {}", where(), field, value, expected));
}

void YamlField::require_map(std::initializer_list<std::string_view> known) const {
  if (!node_.IsMap()) refuse(fmt::format("a map with {}", fmt::join(known, ", ")));
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const YamlField key(entry.first, path_, file_);
    if (!entry.first.IsScalar()) key.refuse("a word as key");
    const std::string& word = entry.first.Scalar();
    if (!seen.insert(word).second)
      key.refuse(fmt::format("key {} a second time", in_quotes(word)), "each key once");
    if (std::find(known.begin(), known.end(), word) == known.end()) take_unknown(key, known);
  }
}

void YamlField::take_unknown(const YamlField& key,
                             std::initializer_list<std::string_view> known) const {
  const std::string& word = key.node_.Scalar();
  if (file_->unknown_keys == UnknownKeys::kRefuse) {
    key.refuse(fmt::format("the key {}", in_quotes(word)),
               fmt::format("{}{}", fmt::join(known, ", "), hint(word, known)));
  }
  events().send({"unknown_key", fmt::format("{}: unknown key {} is ignored{}", key.where(),
                                            in_quotes(child_path(word)), hint(word, known))});
}

std::optional<YamlField> YamlField::find(std::string_view key) const {
  if (!node_.IsMap()) return std::nullopt;
  for (const auto& entry : node_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) {
      return YamlField(entry.second, child_path(key), file_);
    }
  }
  return std::nullopt;
}

YamlField YamlField::at(std::string_view key, std::string_view expected) const {
  if (auto field = find(key)) return *field;
  if (!node_.IsMap()) refuse(fmt::format("a map with {}", key));
  std::string meant;
  for (const auto& entry : node_) {
    const std::size_t distance = edit_distance(entry.first.Scalar().substr(0, kLongestWord), key);
    if (distance <= std::max<std::size_t>(1, key.size() / 4)) {
      meant = fmt::format(" (is {} meant to be it?)", in_quotes(entry.first.Scalar()));
    }
  }
  throw Error(ErrorKind::kBadFile, fmt::format("{}: {} is missing{} - expected {}", where(),
                                               child_path(key), meant, expected));
}

std::vector<YamlField> YamlField::list(std::optional<std::size_t> count,
                                       std::string_view expected) const {
  if (!node_.IsSequence() || (count && node_.size() != *count)) {
    if (!expected.empty()) refuse(expected);
    refuse(count ? fmt::format("a list of {}", *count) : "a list");
  }
  std::vector<YamlField> fields;
  fields.reserve(node_.size());
  for (const YAML::Node& child : node_) {
    fields.push_back(YamlField(child, fmt::format("{}[{}]", path_, fields.size()), file_));
  }
  return fields;
}

double YamlField::number(std::string_view expected) const {
  if (!is_plain_scalar(node_)) refuse(expected);
  const auto value = parse_whole_text<double>(node_.Scalar());
  if (!value || !std::isfinite(*value)) refuse(expected);
  return *value;
}

int YamlField::whole(int low, int high, std::string_view meaning) const {
  const std::string range =
      low == high ? fmt::format("{}", low) : fmt::format("a whole number from {} to {}", low, high);
  const std::string expected = meaning.empty() ? range : fmt::format("{}: {}", range, meaning);
  if (!is_plain_scalar(node_)) refuse(expected);
  const auto value = parse_whole_text<int>(node_.Scalar());
  if (!value || *value < low || *value > high) refuse(expected);
  return *value;
}

int YamlField::whole(std::string_view expected) const {
  const auto value = is_plain_scalar(node_) ? parse_whole_text<int>(node_.Scalar()) : std::nullopt;
  if (!value) refuse(expected);
  return *value;
}

bool YamlField::yes_or_no() const {
  bool value = false;
  if (!is_plain_scalar(node_) || !YAML::convert<bool>::decode(node_, value)) refuse("yes or no");
  return value;
}

std::string YamlField::word(std::string_view expected) const {
  if (!node_.IsScalar()) refuse(expected);
  return node_.Scalar();
}

Eigen::VectorXd YamlField::numbers(std::size_t count, std::string_view expected) const {
  const std::vector<YamlField> fields = list(count, expected);
  Eigen::VectorXd values(static_cast<Eigen::Index>(count));
  for (std::size_t i = 0; i < count; ++i) values[static_cast<Eigen::Index>(i)] = fields[i].number();
  return values;
}

Eigen::MatrixXd YamlField::matrix(int rows, int cols, std::string_view meaning) const {
  require_map({"rows", "cols", "data"});
  at("rows", fmt::format("{}", rows)).whole(rows, rows, meaning);
  at("cols", fmt::format("{}", cols)).whole(cols, cols, meaning);
  const auto count = static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols);
  const Eigen::VectorXd data = at("data", fmt::format("a list of {}", count)).numbers(count);
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(data.data(), rows, cols);
}

void YamlField::read(std::string_view key, double& value, double scale) const {
  if (const auto field = find(key)) value = scale * field->number();
}

void YamlField::read(std::string_view key, int& value) const {
  if (const auto field = find(key)) value = field->whole();
}

void YamlField::read(std::string_view key, bool& value) const {
  if (const auto field = find(key)) value = field->yes_or_no();
}

void YamlField::read(std::string_view key, Eigen::Vector3d& value, double scale) const {
  if (const auto field = find(key)) value = scale * field->numbers(3, "three numbers [x, y, z]");
}

YamlField YamlField::descend(std::string_view path) const {
  const std::string_view step(path.begin(), std::find(path.begin(), path.end(), '.'));
  const std::size_t bracket = std::min(step.find('['), step.size());
  auto field = find(step.substr(0, bracket));
  if (!field) return *this;
  if (bracket < step.size()) {
    const auto index =
        parse_whole_text<std::size_t>(step.substr(bracket + 1, step.size() - bracket - 2));
    const std::vector<YamlField> fields = field->list();
    if (!index || *index >= fields.size()) return *field;
    field = fields[*index];
  }
  return step.size() < path.size() ? field->descend(path.substr(step.size() + 1)) : *field;
}

}  // namespace striper::detail
