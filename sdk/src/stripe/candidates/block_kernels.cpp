// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/candidates/block_kernels.hpp"

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/candidates/block_kernels.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
#include "stripe/candidates/block_columns-inl.hpp"
#include "stripe/candidates/block_rows-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

void columns_u8(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima,
                std::uint8_t* positions) {
  with_reader(planes, [&](const auto& reader) { columns(reader, maxima, positions); });
}
void columns_u16(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima,
                 std::uint16_t* positions) {
  with_reader(planes, [&](const auto& reader) { columns(reader, maxima, positions); });
}
void rows_u8(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima) {
  with_reader(planes, [&](const auto& reader) { rows(reader, maxima); });
}
void rows_u16(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima) {
  with_reader(planes, [&](const auto& reader) { rows(reader, maxima); });
}
void move_u8(const PixelPlanes<std::uint8_t>& planes, const std::uint8_t* maxima, int first_row,
             int count, std::int32_t* across) {
  with_reader(planes, [&](const auto& r) { move_to_maxima(r, maxima, first_row, count, across); });
}
void move_u16(const PixelPlanes<std::uint16_t>& planes, const std::uint16_t* maxima, int first_row,
              int count, std::int32_t* across) {
  with_reader(planes, [&](const auto& r) { move_to_maxima(r, maxima, first_row, count, across); });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(columns_u8);
HWY_EXPORT(columns_u16);
HWY_EXPORT(rows_u8);
HWY_EXPORT(rows_u16);
HWY_EXPORT(move_u8);
HWY_EXPORT(move_u16);

void block_maxima_of_columns(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima,
                             std::uint8_t* positions) {
  HWY_DYNAMIC_DISPATCH(columns_u8)(planes, maxima, positions);
}
void block_maxima_of_columns(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima,
                             std::uint16_t* positions) {
  HWY_DYNAMIC_DISPATCH(columns_u16)(planes, maxima, positions);
}
void block_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, std::uint8_t* maxima) {
  HWY_DYNAMIC_DISPATCH(rows_u8)(planes, maxima);
}
void block_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, std::uint16_t* maxima) {
  HWY_DYNAMIC_DISPATCH(rows_u16)(planes, maxima);
}
void move_to_maxima_of_rows(const PixelPlanes<std::uint8_t>& planes, const std::uint8_t* maxima,
                            int first_row, int count, std::int32_t* across) {
  HWY_DYNAMIC_DISPATCH(move_u8)(planes, maxima, first_row, count, across);
}
void move_to_maxima_of_rows(const PixelPlanes<std::uint16_t>& planes, const std::uint16_t* maxima,
                            int first_row, int count, std::int32_t* across) {
  HWY_DYNAMIC_DISPATCH(move_u16)(planes, maxima, first_row, count, across);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
