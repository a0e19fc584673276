// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <span>

#include <striper/scan/polar_scan.hpp>

namespace striper {

/// Some scans in order, to be looked at one by one or kept: `for (const PolarScan& scan : scans)`,
/// `scans.shared(i)`. As light as a span, and valid as long as one; what `shared` gives is valid as
/// long as it is held.
class ScanSpan {
 public:
  using Shared = std::shared_ptr<const PolarScan>;

  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = PolarScan;
    using difference_type = std::ptrdiff_t;
    using pointer = const PolarScan*;
    using reference = const PolarScan&;

    Iterator() = default;
    explicit Iterator(const Shared* at) : at_(at) {}
    reference operator*() const { return **at_; }
    pointer operator->() const { return at_->get(); }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    Iterator operator++(int) { return Iterator(at_++); }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    const Shared* at_ = nullptr;
  };

  ScanSpan() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): the same thing, seen differently.
  ScanSpan(std::span<const Shared> scans) : scans_(scans) {}

  Iterator begin() const noexcept { return Iterator(scans_.data()); }
  Iterator end() const noexcept { return Iterator(scans_.data() + scans_.size()); }
  bool empty() const noexcept { return scans_.empty(); }
  std::size_t size() const noexcept { return scans_.size(); }
  const PolarScan& operator[](std::size_t i) const noexcept { return *scans_[i]; }
  const PolarScan& back() const noexcept { return *scans_.back(); }

  /// The i-th scan, to keep, or to hand to another thread.
  const Shared& shared(std::size_t i) const noexcept { return scans_[i]; }

 private:
  std::span<const Shared> scans_;
};

}  // namespace striper
