// SPDX-License-Identifier: Apache-2.0
#include "images/picture_numbers.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace striper::detail {
namespace {

constexpr std::string_view kDigits = "0123456789";

// Of fewer files the numbers may as well be a choice of somebody's.
constexpr std::size_t kLeastFiles = 6;

// A file's name with the last number taken out of it.
struct NumberedName {
  std::string around;
  std::uint64_t number = 0;
};

std::optional<NumberedName> take_apart(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  const std::size_t last = stem.find_last_of(kDigits);
  if (last == std::string::npos) return std::nullopt;
  const std::size_t before = stem.find_last_not_of(kDigits, last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  NumberedName name;
  const auto [end, failure] =
      std::from_chars(stem.data() + first, stem.data() + last + 1, name.number);
  if (failure != std::errc()) return std::nullopt;  // Longer than any number of a frame.
  name.around = (file.parent_path() / stem.substr(0, first)).string() + '\0' +
                stem.substr(last + 1) + file.extension().string();
  return name;
}

// How much each number is above the one before; empty where the names are not numbered alike.
std::vector<std::uint64_t> steps_between(const std::vector<std::filesystem::path>& files) {
  std::vector<std::uint64_t> steps;
  std::optional<NumberedName> last;
  for (const std::filesystem::path& file : files) {
    std::optional<NumberedName> name = take_apart(file);
    if (!name) return {};
    if (last) {
      if (name->around != last->around || name->number <= last->number) return {};
      steps.push_back(name->number - last->number);
    }
    last = std::move(name);
  }
  return steps;
}

// The step from one frame to the next where none is lost; 0 if there is no such thing.
std::uint64_t step_of(const std::vector<std::uint64_t>& steps) {
  if (steps.size() + 1 < kLeastFiles) return 0;
  std::map<std::uint64_t, std::size_t> times;
  for (const std::uint64_t step : steps) ++times[step];
  const auto usual = std::max_element(
      times.begin(), times.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (2 * usual->second <= steps.size()) return 0;
  const bool is_regular = std::all_of(steps.begin(), steps.end(),
                                      [&](std::uint64_t step) { return step % usual->first == 0; });
  return is_regular ? usual->first : 0;
}

}  // namespace

std::vector<std::uint64_t> image_numbers(const std::vector<std::filesystem::path>& files) {
  std::vector<std::uint64_t> numbers(files.size());
  std::iota(numbers.begin(), numbers.end(), std::uint64_t{0});
  const std::vector<std::uint64_t> steps = steps_between(files);
  const std::uint64_t step = step_of(steps);
  if (step == 0) return numbers;
  for (std::size_t i = 0; i < steps.size(); ++i) numbers[i + 1] = numbers[i] + steps[i] / step;
  return numbers;
}

}  // namespace striper::detail
