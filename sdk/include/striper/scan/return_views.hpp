// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstddef>
#include <iterator>
#include <span>

#include <striper/scan/return.hpp>

namespace striper {

/// One number of some returns, in their order, without a copy: `scan.range_m()[i]`, or in a loop.
/// As light as a span, and valid as long as the returns are.
class ReturnColumn {
 public:
  class Iterator {
   public:
    using iterator_category = std::random_access_iterator_tag;
    using value_type = double;
    using difference_type = std::ptrdiff_t;
    using pointer = const double*;
    using reference = const double&;

    Iterator() = default;
    Iterator(const Return* at, double Return::*number) : at_(at), number_(number) {}

    reference operator*() const noexcept { return at_->*number_; }
    pointer operator->() const noexcept { return &(at_->*number_); }
    reference operator[](difference_type n) const noexcept { return at_[n].*number_; }
    Iterator& operator++() noexcept { return *this += 1; }
    Iterator& operator--() noexcept { return *this -= 1; }
    Iterator operator++(int) noexcept { return {at_++, number_}; }
    Iterator operator--(int) noexcept { return {at_--, number_}; }
    Iterator& operator+=(difference_type n) noexcept {
      at_ += n;
      return *this;
    }
    Iterator& operator-=(difference_type n) noexcept { return *this += -n; }

    friend Iterator operator+(Iterator it, difference_type n) noexcept { return it += n; }
    friend Iterator operator+(difference_type n, Iterator it) noexcept { return it += n; }
    friend Iterator operator-(Iterator it, difference_type n) noexcept { return it -= n; }
    friend difference_type operator-(const Iterator& a, const Iterator& b) noexcept {
      return a.at_ - b.at_;
    }
    friend bool operator==(const Iterator& a, const Iterator& b) noexcept { return a.at_ == b.at_; }
    friend auto operator<=>(const Iterator& a, const Iterator& b) noexcept {
      return a.at_ <=> b.at_;
    }

   private:
    const Return* at_ = nullptr;
    double Return::*number_ = nullptr;
  };

  ReturnColumn(std::span<const Return> returns, double Return::*number) noexcept
      : returns_(returns), number_(number) {}

  Iterator begin() const noexcept { return {returns_.data(), number_}; }
  Iterator end() const noexcept { return {returns_.data() + returns_.size(), number_}; }
  bool empty() const noexcept { return returns_.empty(); }
  std::size_t size() const noexcept { return returns_.size(); }
  double operator[](std::size_t i) const noexcept { return returns_[i].*number_; }

 private:
  std::span<const Return> returns_;
  double Return::*number_;
};

/// Of some returns those that are kOk, in their order, without a copy. Valid as long as they are.
class OkReturns {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = Return;
    using difference_type = std::ptrdiff_t;
    using pointer = const Return*;
    using reference = const Return&;

    Iterator() = default;
    Iterator(const Return* at, const Return* end) noexcept : at_(at), end_(end) { skip(); }

    reference operator*() const noexcept { return *at_; }
    pointer operator->() const noexcept { return at_; }
    Iterator& operator++() noexcept {
      ++at_;
      skip();
      return *this;
    }
    Iterator operator++(int) noexcept {
      const Iterator before = *this;
      ++*this;
      return before;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    void skip() noexcept {
      while (at_ != end_ && at_->status != ReturnStatus::kOk) ++at_;
    }

    const Return* at_ = nullptr;
    const Return* end_ = nullptr;
  };

  explicit OkReturns(std::span<const Return> returns) noexcept : returns_(returns) {}

  Iterator begin() const noexcept { return {returns_.data(), last()}; }
  Iterator end() const noexcept { return {last(), last()}; }
  bool empty() const noexcept { return begin() == end(); }

 private:
  const Return* last() const noexcept { return returns_.data() + returns_.size(); }

  std::span<const Return> returns_;
};

}  // namespace striper

// Their iterators outlive them, as a span's do.
template <>
inline constexpr bool std::ranges::enable_borrowed_range<striper::ReturnColumn> = true;
template <>
inline constexpr bool std::ranges::enable_view<striper::ReturnColumn> = true;
template <>
inline constexpr bool std::ranges::enable_borrowed_range<striper::OkReturns> = true;
template <>
inline constexpr bool std::ranges::enable_view<striper::OkReturns> = true;
