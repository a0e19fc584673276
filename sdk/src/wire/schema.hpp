// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <striper/wire/cdr.hpp>

#include "wire/describe.hpp"

namespace striper::wire {

/// The type of a field: what it is of, and whether it is an array. `id` is that of
/// type_description_interfaces/msg/FieldType in ROS 2.
struct FieldType {
  int id = 0;
  std::string_view name;   ///< "uint8", or of another message "std_msgs/msg/Header".
  std::size_t length = 0;  ///< Of an array of fixed length; 0 for none.
  bool is_sequence = false;
  bool is_message = false;
  std::size_t text_length = 0;  ///< The most bytes of a text; 0: any.
};

struct FieldText {
  std::string_view name;
  FieldType type;
};

/// A message as text: its fields, and those of the messages that it uses, by their types' names.
struct MessageText {
  std::string_view type;
  std::string_view constants;
  std::vector<FieldText> fields;
};
using UsedMessages = std::map<std::string_view, MessageText>;

MessageSchema make_schema(const MessageText& message, const UsedMessages& used);

// Scalars.
// clang-format off
template <typename T> struct ScalarType;
template <> struct ScalarType<std::int32_t>  { static constexpr FieldType kType{6, "int32"}; };
template <> struct ScalarType<std::uint8_t>  { static constexpr FieldType kType{3, "uint8"}; };
template <> struct ScalarType<std::uint32_t> { static constexpr FieldType kType{7, "uint32"}; };
template <> struct ScalarType<std::int64_t>  { static constexpr FieldType kType{8, "int64"}; };
template <> struct ScalarType<std::uint64_t> { static constexpr FieldType kType{9, "uint64"}; };
template <> struct ScalarType<float>         { static constexpr FieldType kType{10, "float32"}; };
template <> struct ScalarType<double>        { static constexpr FieldType kType{11, "float64"}; };
template <> struct ScalarType<bool>          { static constexpr FieldType kType{15, "bool"}; };
template <> struct ScalarType<std::byte>     { static constexpr FieldType kType{16, "byte"}; };
template <> struct ScalarType<std::string>   { static constexpr FieldType kType{17, "string"}; };
template <std::size_t N> struct ScalarType<BoundedString<N>> { static constexpr FieldType kType{21, "string", 0, false, false, N}; };
// clang-format on

template <typename M>
MessageText message_text(UsedMessages& used);

/// Gathers the fields of a message, and the messages that they are of.
struct FieldGatherer {
  std::vector<FieldText>& fields;
  UsedMessages& used;

  template <typename T>
  void operator()(std::string_view name, const T&) {
    fields.push_back({name, type_of(static_cast<T*>(nullptr))});
  }

 private:
  template <typename T>
  FieldType type_of(T*) {
    if constexpr (Described<T>) {
      if (!used.contains(Description<T>::kType)) {
        used[Description<T>::kType] = message_text<T>(used);
      }
      return {1, Description<T>::kType, 0, false, true};
    } else {
      return ScalarType<T>::kType;
    }
  }
  template <typename T>
  FieldType type_of(std::vector<T>*) {
    FieldType type = type_of(static_cast<T*>(nullptr));
    type.is_sequence = true;
    return type;
  }
  template <typename T, std::size_t N>
  FieldType type_of(std::array<T, N>*) {
    FieldType type = type_of(static_cast<T*>(nullptr));
    type.length = N;
    return type;
  }
};

template <typename M>
MessageText message_text(UsedMessages& used) {
  MessageText text{Description<M>::kType, Description<M>::kConstants, {}};
  const M none{};
  Description<M>::fields(none, FieldGatherer{text.fields, used});
  return text;
}

}  // namespace striper::wire
