// SPDX-License-Identifier: Apache-2.0
#include "web_address.hpp"

#include <charconv>

#include <arpa/inet.h>
#include <fmt/format.h>

#include <striper/core/error.hpp>

namespace striper::detail {
namespace {

[[noreturn]] void refuse(const SinkUri& uri, const std::string& what) {
  throw Error(ErrorKind::kUsage, fmt::format("sink '{}': {}", uri.text(), what));
}

bool is_address(const std::string& text) {
  in6_addr parsed{};
  return ::inet_pton(AF_INET, text.c_str(), &parsed) == 1 ||
         ::inet_pton(AF_INET6, text.c_str(), &parsed) == 1;
}

std::string take_address(const SinkUri& uri, std::string text) {
  if (text == "localhost") return "127.0.0.1";
  if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
  if (is_address(text)) return text;
  refuse(uri, fmt::format("'{}' is no address of an interface; 0.0.0.0 is all of them", text));
}

std::uint16_t take_port(const SinkUri& uri, const std::string& text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error == std::errc() && end == text.data() + text.size() && !text.empty()) return port;
  refuse(uri, fmt::format("'{}' is no port, 0 to 65535 (0: any that is free)", text));
}

}  // namespace

WebAddress WebAddress::parse(SinkUri uri) {
  constexpr double kMostFrames_hz = 1e3;
  WebAddress address;
  const std::size_t colon = uri.path().rfind(':');
  const bool has_address = colon != std::string::npos;
  if (has_address) address.address = take_address(uri, uri.path().substr(0, colon));
  address.port = take_port(uri, has_address ? uri.path().substr(colon + 1) : uri.path());
  address.frames_hz = uri.take_number("frames", 0.0, kMostFrames_hz).value_or(address.frames_hz);
  const std::string images = uri.take("images").value_or("both");
  const std::optional<TopicImages> kind = topic_images_from_string(images);
  if (!kind) {
    refuse(uri, fmt::format("images is '{}' where raw, compressed or both is expected", images));
  }
  address.images = address.frames_hz > 0.0 ? *kind : TopicImages::kNone;
  if (const auto origin = uri.take("origin")) {
    if (!origin->starts_with("http://") && !origin->starts_with("https://")) {
      refuse(uri,
             fmt::format("origin is '{}' where http://HOST or https://HOST is expected", *origin));
    }
    address.origins.push_back(*origin);
  }
  uri.refuse_unused("frames, images, origin");
  return address;
}

}  // namespace striper::detail
