// SPDX-License-Identifier: Apache-2.0
#include "wire/sha256.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <fmt/format.h>

namespace striper::detail {
namespace {

__extension__ using Wide = unsigned __int128;
using Words = std::array<std::uint32_t, 64>;
using State = std::array<std::uint32_t, 8>;

// FIPS 180-4, 4.2.2: of the cube roots of the first 64 primes the first 32 bits behind the
// point. 5.3.3: of the square roots of the first 8. Worked out here: whole-number roots of p 2^96
// and p 2^64 need no table to be typed.
constexpr std::uint32_t root_bits(unsigned prime, int power) {
  // The largest r with r^power <= prime << (32 power), by bits from the top; r < 2^36.
  const auto is_low = [&](Wide r) {
    if (power == 2) return r * r <= (static_cast<Wide>(prime) << 64);
    // r^3 may need 108 bits: fits.
    return r * r * r <= (static_cast<Wide>(prime) << 96);
  };
  Wide root = 0;
  for (int bit = 36; bit >= 0; --bit) {
    const Wide with = root | (static_cast<Wide>(1) << bit);
    if (is_low(with)) root = with;
  }
  return static_cast<std::uint32_t>(root);
}

template <std::size_t N>
constexpr std::array<std::uint32_t, N> roots_of_primes(int power) {
  std::array<std::uint32_t, N> out{};
  unsigned number = 2;
  for (std::size_t found = 0; found < N; ++number) {
    bool is_prime = true;
    for (unsigned d = 2; d * d <= number; ++d) is_prime = is_prime && number % d != 0;
    if (is_prime) out[found++] = root_bits(number, power);
  }
  return out;
}

constexpr Words kRounds = roots_of_primes<64>(3);
constexpr State kStart = roots_of_primes<8>(2);

Words message_schedule(const unsigned char* block) {
  Words w{};
  for (std::size_t t = 0; t < 16; ++t) {
    for (std::size_t byte = 0; byte < 4; ++byte) w[t] = (w[t] << 8) | block[4 * t + byte];
  }
  for (std::size_t t = 16; t < 64; ++t) {
    const std::uint32_t a = w[t - 15];
    const std::uint32_t b = w[t - 2];
    const std::uint32_t sigma0 = std::rotr(a, 7) ^ std::rotr(a, 18) ^ (a >> 3);
    const std::uint32_t sigma1 = std::rotr(b, 17) ^ std::rotr(b, 19) ^ (b >> 10);
    w[t] = sigma1 + w[t - 7] + sigma0 + w[t - 16];
  }
  return w;
}

/// 6.2.2: one block of 64 bytes.
void add_block(State& state, const unsigned char* block) {
  const Words w = message_schedule(block);
  auto [a, b, c, d, e, f, g, h] = state;
  for (std::size_t t = 0; t < 64; ++t) {
    const std::uint32_t sum1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t t1 = h + sum1 + ((e & f) ^ (~e & g)) + kRounds[t] + w[t];
    const std::uint32_t sum0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t t2 = sum0 + ((a & b) ^ (a & c) ^ (b & c));
    h = g;
    g = f;
    f = e;
    e = d + t1;
    d = c;
    c = b;
    b = a;
    a = t1 + t2;
  }
  const State worked{a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < 8; ++i) state[i] += worked[i];
}

/// 5.1.1: a one bit, zeros, and the length in bits at the end of a block.
std::string padded(std::string_view bytes) {
  std::string out(bytes);
  out.push_back('\x80');
  while (out.size() % 64 != 56) out.push_back('\0');
  const std::uint64_t bits = 8 * static_cast<std::uint64_t>(bytes.size());
  for (int shift = 56; shift >= 0; shift -= 8) out.push_back(static_cast<char>(bits >> shift));
  return out;
}

}  // namespace

std::string sha256_hex(std::string_view bytes) {
  const std::string message = padded(bytes);
  State state = kStart;
  for (std::size_t at = 0; at < message.size(); at += 64) {
    add_block(state, reinterpret_cast<const unsigned char*>(message.data()) + at);
  }
  std::string hex;
  for (const std::uint32_t word : state) hex += fmt::format("{:08x}", word);
  return hex;
}

}  // namespace striper::detail
