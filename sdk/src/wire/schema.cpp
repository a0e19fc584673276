// SPDX-License-Identifier: Apache-2.0
#include "wire/schema.hpp"

#include <fmt/format.h>

#include "wire/sha256.hpp"

namespace striper::wire {
namespace {

/// "std_msgs/Header" of "std_msgs/msg/Header".
std::string short_name(std::string_view type) {
  const std::size_t middle = type.find("/msg/");
  return fmt::format("{}/{}", type.substr(0, middle), type.substr(middle + 5));
}

std::string type_text(const FieldType& type) {
  std::string text = type.is_message ? short_name(type.name) : std::string(type.name);
  if (type.text_length > 0) text += fmt::format("<={}", type.text_length);
  if (type.is_sequence) text += "[]";
  if (type.length > 0) text += fmt::format("[{}]", type.length);
  return text;
}

std::string lines(const MessageText& message) {
  std::string text(message.constants);
  for (const FieldText& field : message.fields) {
    text += fmt::format("{} {}\n", type_text(field.type), field.name);
  }
  return text;
}

std::string schema_text(const MessageText& message, const UsedMessages& used) {
  std::string text = lines(message);
  for (const auto& [type, other] : used) {
    text += fmt::format("{:=<80}\nMSG: {}\n{}", "", short_name(type), lines(other));
  }
  return text;
}

/// FieldType.msg of type_description_interfaces: arrays are 48 above their element, sequences 144.
int array_id(const FieldType& type) {
  if (type.is_sequence) return type.id + 144;
  return type.length > 0 ? type.id + 48 : type.id;
}

std::string description_json(const MessageText& message) {
  std::string fields;
  for (const FieldText& field : message.fields) {
    fields += fmt::format(
        R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
        fields.empty() ? "" : ", ", field.name, array_id(field.type), field.type.length,
        field.type.text_length, field.type.is_message ? field.type.name : "");
  }
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", message.type, fields);
}

std::string type_hash(const MessageText& message, const UsedMessages& used) {
  std::string others;
  for (const auto& [type, other] : used) {
    others += (others.empty() ? "" : ", ") + description_json(other);
  }
  return "RIHS01_" + striper::detail::sha256_hex(fmt::format(
                         R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                         description_json(message), others));
}

}  // namespace

MessageSchema make_schema(const MessageText& message, const UsedMessages& used) {
  return {std::string(message.type), schema_text(message, used), type_hash(message, used)};
}

}  // namespace striper::wire
