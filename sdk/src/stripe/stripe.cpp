// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <numeric>

#include <striper/stripe/stripe.hpp>

namespace striper {

void Stripe::reset(int lines) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();
  resize(lines);
  across_px.assign(across_px.size(), kNan);
  for (std::vector<float>* values : {&sigma_px, &amplitude_dn, &width_px, &confidence}) {
    values->assign(values->size(), kNanF);
  }
  status.assign(status.size(), ReturnStatus::kNoStripe);
}

void Stripe::resize(int lines) {
  const auto count = static_cast<std::size_t>(lines);
  line_count = lines;
  line.resize(count);
  std::iota(line.begin(), line.end(), 0);
  across_px.resize(count);
  for (std::vector<float>* values : {&sigma_px, &amplitude_dn, &width_px, &confidence}) {
    values->resize(count);
  }
  status.resize(count);
}

void Stripe::drop(std::size_t i, ReturnStatus reason) {
  across_px[i] = std::numeric_limits<double>::quiet_NaN();
  for (std::vector<float>* values : {&sigma_px, &amplitude_dn, &width_px, &confidence}) {
    (*values)[i] = std::numeric_limits<float>::quiet_NaN();
  }
  status[i] = reason;
}

void Stripe::clear() {
  line.clear();
  across_px.clear();
  for (std::vector<float>* values : {&sigma_px, &amplitude_dn, &width_px, &confidence}) {
    values->clear();
  }
  status.clear();
}

void Stripe::reserve(std::size_t count) {
  line.reserve(count);
  across_px.reserve(count);
  for (std::vector<float>* values : {&sigma_px, &amplitude_dn, &width_px, &confidence}) {
    values->reserve(count);
  }
  status.reserve(count);
}

std::size_t Stripe::append(int line_number) {
  line.push_back(line_number);
  across_px.push_back(std::numeric_limits<double>::quiet_NaN());
  for (std::vector<float>* values : {&sigma_px, &amplitude_dn, &width_px, &confidence}) {
    values->push_back(std::numeric_limits<float>::quiet_NaN());
  }
  status.push_back(ReturnStatus::kNoStripe);
  return line.size() - 1;
}

}  // namespace striper
