// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "wire/describe.hpp"

namespace striper::wire {

static_assert(std::endian::native == std::endian::little,
              "numbers are copied as they lie in memory");

/// Numbers, and std::byte: what is copied as it is. bool is not: its bytes must be 0 or 1.
template <typename T>
concept Plain =
    (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) || std::is_same_v<T, std::byte>;

inline constexpr std::size_t kEncapsulationBytes = 4;

/// Appends values as XCDR1: each number at a multiple of its size, counted from behind the
/// encapsulation (OMG, Extensible and Dynamic Topic Types 1.3, 7.4.1).
class CdrWriter {
 public:
  explicit CdrWriter(std::vector<std::uint8_t>& out) : out_(out) { out_.assign({0, 1, 0, 0}); }

  template <typename T>
  void operator()(std::string_view, const T& value) {
    put(value);
  }

  template <Plain T>
  void put(const T& value) {
    put_array(&value, 1);
  }
  void put(bool value) { out_.push_back(value ? 1 : 0); }
  void put(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    put_array(text.c_str(), text.size() + 1);
  }
  template <Described M>
  void put(const M& message) {
    Description<M>::fields(message, *this);
  }
  template <typename T, std::size_t N>
  void put(const std::array<T, N>& values) {
    put_array(values.data(), N);
  }
  template <typename T>
  void put(const std::vector<T>& values) {
    put(static_cast<std::uint32_t>(values.size()));
    if constexpr (Plain<T>) {
      put_array(values.data(), values.size());
    } else {
      for (const T& value : values) put(value);
    }
  }

 private:
  template <Plain T>
  void put_array(const T* values, std::size_t count) {
    if (count == 0) return;  // An empty sequence has no padding behind its length.
    const std::size_t position = out_.size() - kEncapsulationBytes;
    out_.insert(out_.end(), (sizeof(T) - position % sizeof(T)) % sizeof(T), 0);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(values);
    out_.insert(out_.end(), bytes, bytes + count * sizeof(T));
  }

  std::vector<std::uint8_t>& out_;
};

/// Takes values from XCDR1 bytes. @throws Error as `read_cdr`.
class CdrReader {
 public:
  CdrReader(std::span<const std::uint8_t> bytes, std::string_view type);

  template <typename T>
  void operator()(std::string_view name, T& value) {
    field_ = name;
    get(value);
  }

  template <Plain T>
  void get(T& value) {
    get_array(&value, 1);
  }
  void get(bool& value);
  void get(std::string& text);
  template <Described M>
  void get(M& message) {
    Description<M>::fields(message, *this);
  }
  template <typename T, std::size_t N>
  void get(std::array<T, N>& values) {
    get_array(values.data(), N);
  }
  template <typename T>
  void get(std::vector<T>& values) {
    const std::string_view field = field_;
    if constexpr (Plain<T>) {
      values.resize(get_count(sizeof(T)));
      get_array(values.data(), values.size());
    } else {
      get_each(values, get_count(1));
    }
    field_ = field;
  }

  /// Nothing but padding to a multiple of 4 may be left.
  void require_end() const;

 private:
  /// One at a time: memory is taken for what is there, not for what a length says is.
  template <typename T>
  void get_each(std::vector<T>& values, std::size_t count) {
    values.resize(std::min(values.size(), count));
    for (T& value : values) get(value);
    while (values.size() < count) get(values.emplace_back());
  }

  template <Plain T>
  void get_array(T* values, std::size_t count) {
    if (count == 0) return;
    const std::uint8_t* bytes = take(sizeof(T), count);
    std::memcpy(values, bytes, count * sizeof(T));
    if (sizeof(T) > 1 && is_swapped_) swap_bytes(values, count);
  }

  template <typename T>
  static void swap_bytes(T* values, std::size_t count) {
    auto* bytes = reinterpret_cast<std::uint8_t*>(values);
    for (std::size_t i = 0; i < count; ++i, bytes += sizeof(T)) {
      std::reverse(bytes, bytes + sizeof(T));
    }
  }

  /// `count` values of `size` bytes, behind the padding that they need.
  const std::uint8_t* take(std::size_t size, std::size_t count);
  /// The length of a sequence whose elements take `size` bytes or more.
  std::size_t get_count(std::size_t size);
  [[noreturn]] void refuse(const std::string& what) const;

  std::span<const std::uint8_t> bytes_;
  std::string_view type_;
  std::string_view field_;
  std::size_t at_ = kEncapsulationBytes;
  bool is_swapped_ = false;
};

}  // namespace striper::wire
