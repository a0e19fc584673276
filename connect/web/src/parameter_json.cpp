// SPDX-License-Identifier: Apache-2.0
#include "parameter_json.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(const std::string& name) {
  throw Error(
      ErrorKind::kBadValue,
      fmt::format("{}: null, true, false, a number, a text or a list of up to 16 numbers is "
                  "expected",
                  name));
}

std::vector<double> numbers(const std::string& name, const json& list) {
  constexpr std::size_t kMost = 16;  // A pose has 6.
  if (list.size() > kMost) refuse(name);
  std::vector<double> all;
  for (const json& one : list) {
    if (!one.is_number()) refuse(name);
    all.push_back(one.get<double>());
  }
  return all;
}

}  // namespace

json to_json(const ParameterValue& value) {
  struct Made {
    json operator()(std::monostate) const { return nullptr; }
    json operator()(bool is_on) const { return is_on; }
    json operator()(double number) const { return number; }
    json operator()(const std::string& word) const { return word; }
    json operator()(const std::vector<double>& list) const { return list; }
  };
  return std::visit(Made{}, value);
}

Parameter parameter_of(const std::string& name, const json& value) {
  if (value.is_null()) return {name, {}};
  if (value.is_boolean()) return {name, value.get<bool>()};
  if (value.is_number()) return {name, value.get<double>()};
  if (value.is_string()) return {name, value.get<std::string>()};
  if (value.is_array()) return {name, numbers(name, value)};
  refuse(name);
}

json parse_json(std::string_view text) {
  const auto refuse_deep = [](int depth, json::parse_event_t, json&) {
    constexpr int kDeepest = 16;  // Nothing that clients say is deeper than 4.
    if (depth <= kDeepest) return true;
    throw Error(ErrorKind::kBadValue,
                fmt::format("this JSON is nested more than {} deep", kDeepest));
  };
  json whole = json::parse(text, refuse_deep, false);
  if (whole.is_discarded()) throw Error(ErrorKind::kBadValue, "this is no JSON");
  return whole;
}

std::string dump_json(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace striper::detail
