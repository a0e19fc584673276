// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/evidence/mean_about.hpp"

namespace striper::detail {
namespace {

constexpr float kGain = 0.2F;

}  // namespace

MeanAbout::Side MeanAbout::Side::followed_by(float value) const {
  return {any ? mean + kGain * (value - mean) : value, true};
}

void MeanAbout::reserve(std::size_t most) {
  before_.reserve(most);
  after_.reserve(most);
}

void MeanAbout::find(const StripePieces& pieces, const std::vector<float>& values, float none,
                     std::vector<float>& means) {
  const std::size_t size = pieces.size();
  before_.assign(size, Side{});
  after_.assign(size, Side{});
  const auto before_of = [&](std::size_t i) { return pieces.link(i).before; };
  for (std::size_t i = 0; i < size; ++i) {
    if (before_of(i) < 0) continue;
    const auto b = static_cast<std::size_t>(before_of(i));
    before_[i] = before_[b].followed_by(values[b]);
  }
  for (std::size_t i = size; i-- > 0;) {
    if (before_of(i) < 0) continue;
    after_[static_cast<std::size_t>(before_of(i))] = after_[i].followed_by(values[i]);
  }
  means.resize(size);
  for (std::size_t i = 0; i < size; ++i) {
    const Side& b = before_[i];
    const Side& a = after_[i];
    const float sides = static_cast<float>(b.any) + static_cast<float>(a.any);
    means[i] = sides > 0.0F ? (b.mean + a.mean) / sides : none;
  }
}

}  // namespace striper::detail
