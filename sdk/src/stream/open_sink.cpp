// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <mutex>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/sinks/csv_sink.hpp>

#include "stream/sinks/built_in.hpp"

namespace striper {
namespace {

struct Kind {
  std::string scheme;
  std::string extension;
  SinkFactory factory;
};

// Every kind of sink, the latest first.
class Kinds {
 public:
  static Kinds& all() {
    static Kinds kinds;
    return kinds;
  }

  void add(Kind kind) {
    const std::lock_guard lock(mutex_);
    std::erase_if(kinds_, [&](const Kind& other) { return other.scheme == kind.scheme; });
    kinds_.insert(kinds_.begin(), std::move(kind));
  }

  template <typename Predicate>
  std::optional<Kind> find(Predicate is_meant) const {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kinds_.begin(), kinds_.end(), is_meant);
    return found == kinds_.end() ? std::nullopt : std::optional(*found);
  }

  std::vector<std::string> list(std::string Kind::*what) const {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> words;
    for (const Kind& kind : kinds_) {
      if (!(kind.*what).empty()) words.push_back(kind.*what);
    }
    std::sort(words.begin(), words.end());
    return words;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Kind> kinds_{
      {"csv", ".csv", detail::make_csv_sink},    {"jsonl", ".jsonl", detail::make_jsonl_sink},
      {"mcap", ".mcap", detail::make_mcap_sink}, {"ply", ".ply", detail::make_point_sink},
      {"pcd", ".pcd", detail::make_point_sink},  {"las", ".las", detail::make_point_sink},
      {"ros2", "", detail::make_plugin_sink},    {"web", "", detail::make_plugin_sink}};
};

std::optional<Kind> kind_of_scheme(std::string_view scheme) {
  return Kinds::all().find([&](const Kind& kind) { return kind.scheme == scheme; });
}

std::string scheme_of_path(std::string_view text, std::string_view path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension.empty() || path.starts_with("/dev/")) return "csv";
  const auto kind = Kinds::all().find([&](const Kind& one) { return one.extension == extension; });
  if (kind) return kind->scheme;
  require_replaceable_by_scans(std::string(path));  // Says what matters more.
  throw Error(
      ErrorKind::kUsage,
      fmt::format("sink '{}': a file {} is of no kind that is known; there are {} (csv:PATH "
                  "is a CSV, whatever it is called)",
                  text, extension, fmt::join(Kinds::all().list(&Kind::extension), ", ")));
}

}  // namespace

SinkUri SinkUri::parse(std::string_view text) {
  if (text.empty()) throw Error(ErrorKind::kUsage, "the sink is empty: name a file");
  SinkUri uri("sink", text);
  const std::string_view address = uri.address();
  const std::string_view word = scheme_word(address);
  if (kind_of_scheme(word)) {
    uri.scheme_ = word;
    uri.path_ = address.substr(word.size() + 1);
  } else if (!word.empty()) {
    throw Error(ErrorKind::kUsage,
                fmt::format("sink '{}': unknown kind '{}'; there are {} (a path that contains a "
                            "colon is written csv:PATH)",
                            text, word, fmt::join(sink_schemes(), ", ")));
  } else {
    uri.path_ = address;
    uri.scheme_ = scheme_of_path(text, address);
  }
  return uri;
}

std::unique_ptr<ScanSink> open_sink(std::string_view uri) { return open_sink(SinkUri::parse(uri)); }

std::unique_ptr<ScanSink> open_sink(SinkUri uri) {
  const std::optional<Kind> kind = kind_of_scheme(uri.scheme());
  if (!kind) throw Error(ErrorKind::kUsage, fmt::format("there is no sink {}:", uri.scheme()));
  return kind->factory(std::move(uri));
}

void register_sink(std::string scheme, SinkFactory factory, std::string extension) {
  Kinds::all().add({std::move(scheme), std::move(extension), std::move(factory)});
}

std::vector<std::string> sink_schemes() { return Kinds::all().list(&Kind::scheme); }

}  // namespace striper
