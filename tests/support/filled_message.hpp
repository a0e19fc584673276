// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "support/random.hpp"
#include "wire/describe.hpp"

namespace striper::testing {

/// Fills every field of a message with a value of its own: numbers of random bits (infinities and
/// every other number that is none turned into the one NaN that all languages keep), texts with
/// accents, arrays of random lengths, 0 included.
class MessageFiller {
 public:
  template <typename T>
  void operator()(std::string_view, T& value) {
    fill(value);
  }

  template <typename T>
  requires std::is_integral_v<T>
  void fill(T& value) { value = static_cast<T>(random_generator()()); }
  void fill(bool& value) { value = random_generator()() % 2 == 1; }
  void fill(std::byte& value) { value = std::byte(random_generator()() % 4); }
  void fill(double& value) { value = number(std::bit_cast<double>(random_generator()())); }
  void fill(float& value) {
    value = number(std::bit_cast<float>(static_cast<std::uint32_t>(random_generator()())));
  }
  void fill(std::string& text) {
    text.assign(random_generator()() % 9, static_cast<char>('a' + random_generator()() % 26));
    if (random_generator()() % 3 == 0) text += "\u00e9\u4e16";
  }
  template <typename T, std::size_t N>
  void fill(std::array<T, N>& values) {
    for (T& value : values) fill(value);
  }
  template <typename T>
  void fill(std::vector<T>& values) {
    values.resize(random_generator()() % 6);
    for (T& value : values) fill(value);
  }
  template <wire::Described M>
  void fill(M& message) {
    wire::Description<M>::fields(message, *this);
  }

 private:
  template <typename T>
  static T number(T value) {
    switch (random_generator()() % 8) {
      case 0:
        return std::numeric_limits<T>::quiet_NaN();
      case 1:
        return std::numeric_limits<T>::infinity();
      default:
        return value == value ? value : std::numeric_limits<T>::quiet_NaN();
    }
  }
};

template <typename M>
M filled_message() {
  M message;
  MessageFiller().fill(message);
  return message;
}

}  // namespace striper::testing
