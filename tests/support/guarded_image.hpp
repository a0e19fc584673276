// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <utility>

#include <opencv2/core/mat.hpp>
#include <sys/mman.h>
#include <unistd.h>

namespace striper::testing {

/// Pixels between two pages of memory that nobody may touch: a kernel that reads a single element
/// before the first or after the last one ends the test program, whatever it was built with.
class GuardedImage {
 public:
  enum class Against { kFirst, kLast };  ///< The pixel that lies at a page that is guarded.

  GuardedImage() = default;

  /// @param stride bytes from row to row, at least a row's. After the last row there is nothing.
  /// All bytes are 0.
  GuardedImage(int rows, int cols, int type, std::size_t stride, Against against) {
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    const std::size_t bytes = static_cast<std::size_t>(rows - 1) * stride +
                              static_cast<std::size_t>(cols) * CV_ELEM_SIZE(type);
    const std::size_t pages = (bytes + page - 1) / page;
    size_ = (pages + 2) * page;
    void* const memory = ::mmap(nullptr, size_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    memory_ = static_cast<std::uint8_t*>(memory);
    ::mprotect(memory_ + page, pages * page, PROT_READ | PROT_WRITE);
    std::uint8_t* const first =
        memory_ + page + (against == Against::kFirst ? 0 : pages * page - bytes);
    image_ = cv::Mat(rows, cols, type, first, stride);
  }
  GuardedImage(GuardedImage&& other) noexcept { *this = std::move(other); }
  GuardedImage& operator=(GuardedImage&& other) noexcept {
    std::swap(memory_, other.memory_);
    std::swap(size_, other.size_);
    cv::swap(image_, other.image_);
    return *this;
  }
  ~GuardedImage() {
    if (memory_ != nullptr) ::munmap(memory_, size_);
  }

  const cv::Mat& image() const noexcept { return image_; }

  /// Sets what lies between its rows, which belongs to nobody either.
  void fill_gaps(std::uint8_t value) {
    const std::size_t row_bytes = static_cast<std::size_t>(image_.cols) * image_.elemSize();
    for (int row = 0; row + 1 < image_.rows; ++row) {
      std::memset(image_.ptr(row) + row_bytes, value, image_.step[0] - row_bytes);
    }
  }

 private:
  std::uint8_t* memory_ = nullptr;
  std::size_t size_ = 0;
  cv::Mat image_;
};

}  // namespace striper::testing
